"""The effects of a motor that was found: how large, how sure, and what else could be in their place."""

import dataclasses
import math

import numpy as np

from jaxmotor.diagnosis._certainty import OF_FAMILY, of_name
from jaxmotor.diagnosis._errors import differs, effect_errors
from jaxmotor.diagnosis._found import EXPLAINED, NONE, Explained, Found, Named
from jaxmotor.diagnosis._found_effect import Alternative, FoundEffect
from jaxmotor.diagnosis._held_out import HeldOut
from jaxmotor.diagnosis._moments import moment_error
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.diagnosis._visited import falling
from jaxmotor.motor.effects import (
    LEARNED,
    OF_LOG,
    AbstractEffect,
    AbstractLearnedEffect,
    AbstractStepInTime,
    parameters,
)

ALTERNATIVES = 4
"""Of each effect that are scored on held-out rows."""
FAR = 2.0
"""Times chi2 of a motor, above which nobody asks how much worse another one is, exactly, and which is far worse."""
SCATTERS = 2.0
"""Standard deviations of chi2 per sample that rows held out may have beside the noise."""
UNKNOWN = 0.5
"""Relative standard error from which a parameter is not determined."""


def judged_by(held: HeldOut, found: Found, explained: Explained) -> Found:
    """`found` with the shares that stay unexplained of rows held out: there an effect that only imitates a law explains
    less than where it was fitted. Where the noise is estimated they are asked for only if something of the fitted rows
    stays unexplained, too, or the linear motor predicts them better."""
    asked = found.unexplained_share or explained.noise_known or held.is_worse
    if not held.own or not asked:
        return found
    scatter = SCATTERS * math.sqrt(2 / max(len(held.test.cells), 1)) if explained.noise_known else 0.0

    def share(shorter: float) -> float:
        return explained.share_left(held.fitted, shorter, held.after.drift - scatter)

    named = tuple(dataclasses.replace(one, held_out_share=share(held.without(one.name))) for one in found.named)
    return dataclasses.replace(found, named=named, held_out_share=share(held.before.drift))


def found_effects(study: Study, held: HeldOut, found: Found, spread: np.ndarray) -> tuple[FoundEffect, ...]:
    rig = rig_of(study.recording, study.trial)
    errors = effect_errors(found.fitted, spread, rig)
    effects = []
    alternatives = _alternatives(held, found)
    about = {named.name: named for named in found.named}
    for effect, error in zip(found.fitted.motor.effects, errors, strict=True):
        if isinstance(effect, OF_LOG):
            continue
        if isinstance(effect, AbstractStepInTime):
            error["moment_s"] = moment_error(study.solver, found.fitted, effect, rig)
        without = held.without(effect.name)
        gain = 100 * (1 - held.after.drift / max(without, 1e-300))
        own, more, unknown = about[effect.name], _more_than_ordinary(effect, error), _unknown(effect, error)
        of_family = found.families.get(effect.family, 0.0)
        is_likeliest = of_family >= max(found.families.values(), default=0.0)
        sure, with_equal, with_law, family, kin = (more * share for share in _sureness(own, of_family, is_likeliest))
        if _may_be_none(effect, unknown):
            sure = with_equal = with_law = 0.0
        if held.is_worse and gain <= 0:
            # Without it rows that were held out are predicted better.
            sure = with_equal = with_law = family = kin = 0.0
        if (instead := _overtaken_by(held, found, own, alternatives[own.name])) is not None:
            sure = with_equal = with_law = kin = 0.0
            family *= instead.family == effect.family
        effects.append(
            FoundEffect(
                effect,
                error,
                gain,
                alternatives[own.name],
                unknown,
                probability=sure,
                family_probability=with_equal,
                of_family=family,
                unexplained_share=own.unexplained_share,
                held_out_share=own.held_out_share,
                name_probability=with_law,
                kin_probability=max(sure, kin if effect.family else 0.0),
            )
        )
    return tuple(sorted(effects, key=lambda one: -one.held_out_gain_percent))


def _overtaken_by(
    held: HeldOut, found: Found, named: Named, alternatives: tuple[Alternative, ...]
) -> AbstractEffect | None:
    """The effect in the place of the `named` one that is told from it and predicts held-out rows far better."""
    drift = held.after.drift
    far = [one.name for one in alternatives if drift + one.chi2_excess < drift / FAR and not one.inseparable]
    if not (held.own and drift > EXPLAINED and far):
        return None
    return next(one for one in (_added(other, found) for other in named.alternatives) if one.name == far[0])


def _more_than_ordinary(effect: AbstractEffect, error: dict[str, float]) -> float:
    """Confidence of the widest interval of its size that lies above what any motor has."""
    if not effect.ordinary:
        return 1.0
    [(name, spread)] = error.items()
    apart = float(getattr(effect, name)) - effect.ordinary
    return math.erf(max(apart, 0.0) / (math.sqrt(2) * spread)) if spread > 0 else 1.0


def _may_be_none(effect: AbstractEffect, unknown: tuple[str, ...]) -> bool:
    """All that it takes or adds is within its error of zero: something is there, but this says nothing of it."""
    about = parameters(effect)
    sizes = [name for name in about if about[name]["neutral"] == 0.0 and name != "phase_rad"]
    return bool(sizes) and set(sizes) <= set(unknown)


def _sureness(named: Named, of_family: float, is_likeliest: bool) -> tuple[float, float, float, float, float]:
    """The probabilities of an effect, of it or its equals, of those that are laws, and of any of its family, by weights
    alone `of_family`; and the last one as sure as a name is. That something depends on a coordinate, as a curve says,
    is as sure as a family. Equals of other families count as its own where that `is_likeliest`."""
    share = named.unexplained_share
    sure = OF_FAMILY(share) if named.name in LEARNED else of_name(share, named.held_out_share)
    with_equal = sure * named.with_equal
    least = with_equal if is_likeliest else sure * named.probability
    family = max(OF_FAMILY(share) * of_family, least) if of_family else 0.0
    return sure * named.probability, with_equal, sure * named.with_law, family, sure * of_family


def _unknown(effect: AbstractEffect, error: dict[str, float]) -> tuple[str, ...]:
    if isinstance(effect, AbstractLearnedEffect):
        # Its terms mean nothing one by one.
        return ()
    values = {name: float(getattr(effect, name)) for name in error}
    return tuple(name for name in error if name != "phase_rad" and error[name] > UNKNOWN * abs(values[name]))


def probabilities(found: Found, effects: tuple[FoundEffect, ...]) -> dict[str, float]:
    """Of each effect that was tried and of `none`, the largest first."""
    sure = of_name(found.unexplained_share, found.held_out_share)
    each = {name: share if name == NONE else sure * share for name, share in found.probabilities.items()}
    return falling(each | {one.name: one.probability for one in effects} if each else each)


def families(found: Found, effects: tuple[FoundEffect, ...]) -> dict[str, float]:
    """Of each family of effects, the largest first."""
    each = {family: OF_FAMILY(found.unexplained_share) * share for family, share in found.families.items()}
    for one in effects:
        each[one.effect.family] = max(each.get(one.effect.family, 0.0), one.of_family)
    return falling({family: share for family, share in each.items() if family})


def _alternatives(held: HeldOut, found: Found) -> dict[str, tuple[Alternative, ...]]:
    """Of each effect."""
    pairs = [(named, other) for named in found.named for other in named.alternatives[:ALTERNATIVES]]
    added = [_added(other, found) for _, other in pairs]
    far = FAR * held.fitted.chi2
    bars = [np.inf if one.name in named.equal else far for one, (named, _) in zip(added, pairs, strict=True)]
    drifts = side_by_side(
        lambda pair: held.drift(pair[0][1].motor, pair[0][1], pair[1]), list(zip(pairs, bars, strict=True))
    )
    alternatives: dict[str, list[Alternative]] = {named.name: [] for named in found.named}
    for one, (named, _), drift in zip(added, pairs, drifts, strict=True):
        if drift <= held.before.drift:
            equal, wider = one.name in named.equal, named.name in one.contains
            alternatives[named.name].append(Alternative(one.name, drift - held.after.drift, equal, wider))
    return {name: tuple(sorted(its, key=lambda one: one.chi2_excess)) for name, its in alternatives.items()}


def indistinguishable_motors(found: Found, effects: tuple[FoundEffect, ...]) -> dict[tuple[str, str], Fitted]:
    """Motors that explain the recording as well, by the effect that was named and the one in its place."""
    indistinguishable = {}
    for named in found.named:
        [effect] = [effect for effect in effects if effect.name == named.name]
        close = [one.name for one in effect.alternatives if one.inseparable and not one.wider]
        for other in named.alternatives[:ALTERNATIVES]:
            name = _added(other, found).name
            if name in close:
                indistinguishable[named.name, name] = other
    return indistinguishable


def _added(other: Fitted, found: Found) -> AbstractEffect:
    """The effect of `other` that the motor of `found` has not."""
    return next(effect for effect in other.template.effects if effect.name not in found.fitted.names)


def ambiguous(fitted: Fitted, spread: np.ndarray, indistinguishable: dict[tuple[str, str], Fitted]) -> list[str]:
    """What depends on which of them it is."""
    notes = []
    for (name, other), instead in indistinguishable.items():
        away, own, its = differs(fitted, spread, instead), fitted.motor.linear, instead.motor.linear
        moved = [
            f"the {what} is {float(getattr(its, what)):.4g} {unit}, not {float(getattr(own, what)):.4g}"
            for place, what, unit in ((0, "gain", "rad/s/V"), (1, "pole", "rad/s"))
            if away[place]
        ]
        if moved:
            notes.append(f"with {other} in place of {name} {', and '.join(moved)}")
    return notes
