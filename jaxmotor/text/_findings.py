"""What a diagnosis found, in sentences without their full stop."""

import math
from collections.abc import Callable, Sequence

from jaxmotor._numbers import voltage
from jaxmotor._sentences import named
from jaxmotor.diagnosis import Dependence, Diagnosis, FoundEffect, LoopGain, ResidualVoltage
from jaxmotor.estimate import Noise
from jaxmotor.recording import ranges
from jaxmotor.text._effects import family_of
from jaxmotor.validation import ClosedLoop, Comparison, StepTrials

RPM = 60 / (2 * math.pi)
"""rpm in one rad/s."""


def floor(known: bool) -> str:
    """What a chi2 per sample of 1 stands for, by whether the noise was known beforehand."""
    return "the encoder's rounding" if known else "the noise, estimated from this log"


def noise_words(noise: Noise) -> str:
    """The noise of one reading in the log's unit."""
    if noise.known:
        return level_words(noise)
    unit = noise.unit.name
    step = "" if noise.step is None else f"; readings come in steps of {noise.step / noise.unit.si:.4g} {unit}"
    new = noise.row_to_row / noise.unit.si
    return f"{level_words(noise)}, of which {new:.3g} {unit} is new in each row{step}"


def level_words(noise: Noise) -> str:
    """The same, its size alone."""
    unit = noise.unit
    if noise.known:
        return f"rounding to whole {unit.name}"
    what = "" if noise.measured == "speed" else " on the turn from row to row"
    return f"{noise.level / unit.si:.3g} {unit.name}{what}"


def of_rounding(residual: ResidualVoltage) -> str:
    """The part of the residual voltage that the encoder makes, after a comma; nothing where that is not known."""
    if not math.isfinite(residual.noise_V):
        return ""
    return f", of which the encoder's rounding makes {voltage(residual.noise_V)}"


def nothing_left() -> str:
    """Of a recording that a linear motor describes."""
    return "that is the noise: the linear model explains all that this recording shows"


def seen_in(dependence: Dependence) -> str:
    """How much of the residual voltage depends on what."""
    chance = 100 * max(dependence.chance, 0.01)
    return f"{100 * dependence.share:.0f} % of that: {dependence.text} (by chance {chance:.0f} %)"


def looks_like(diagnosis: Diagnosis) -> str | None:
    """What the unexplained residual depends on; None where there is none."""
    dependence = diagnosis.looks_like
    if dependence is None:
        return None
    if diagnosis.undecided:
        return f"the residual is no more than noise, but there may be {dependence.text}"
    if diagnosis.named_disturbances:
        return f"something acted from outside, which is no part of the motor: {dependence.text}"
    residual = "unexplained residual" if diagnosis.effects else "residual voltage"
    more = "no further effect" if any(found.is_told for found in diagnosis.effects) else "no effect"
    if not len(dependence.at):
        return f"the {residual} is {dependence.text}; {more} is named"
    return f"the {residual} looks like {dependence.text}; {more} is named: this says what it depends on, not why"


def may_be(found: FoundEffect, name: Callable[[str], str]) -> str | None:
    """The alternatives that cannot be distinguished from the effect, each called by `name`; None without any."""
    equal = [one for one in found.alternatives if one.inseparable]
    wider = [name(one.name) for one in equal if one.wider]
    same = [name(one.name) for one in equal if not one.wider]
    told = []
    if same:
        told.append(f"may as well be {' or '.join(same)}: indistinguishable in this recording")
    if wider:
        told.append(f"the recording shows no need of {' or '.join(wider)}, which contains it")
    return "; ".join(told) if told else None


def cause(found: FoundEffect, again: bool = False) -> str:
    """Of an effect that is told (`is_told`): its name with its probability, or what it may as well be where these have
    nothing in common, or its family where that is all that may be said, `again` where of another one it was, too."""
    own = f"probability {percent(found.probability)}"
    if found.is_one_of_several:
        together = percent(found.name_probability)
        several = either([found.name, *equals(found)], str)
        return f"{several}: which of them, this recording does not tell (together {together}); if it is {found.name}"
    if found.is_named:
        also = f", with the alternatives that fit as well {percent(found.family_probability)}" if equals(found) else ""
        return f"{found.name} ({own}{also})"
    known = f" (probability {percent(found.of_family)})" if found.effect.family else ""
    share = percent(found.probability)
    like = f", which itself has a probability of {share}" if found.probability < HARDLY else f" ({share})"
    family = "another one of that family" if again else family_of(found.effect)
    return f"{family}{known}, most like {found.name}{like}"


def unlikely(found: FoundEffect) -> str:
    """The effect with its probability, where neither it nor its family is likely to be a cause."""
    return f"{found.name} (probability {percent(found.probability)})"


HARDLY = 0.1
"""Probability below which a law is told to be like what was found, and how little likely it is itself."""
LITTLE = 0.005
"""Probability that is told as next to none."""


def odds(found: FoundEffect) -> list[tuple[str, float]]:
    """Names and probabilities [1]: of the effect, of the alternatives that fit as well, of the rest of its family, and
    of none of these."""
    same = min(found.family_probability, 1.0)
    own, family = min(found.probability, same), max(min(found.of_family, 1.0), same)
    instead = [(f"{either(equals(found))} instead", same - own)] if equals(found) else []
    few = found.is_named and family - same < LITTLE
    others = [] if few else [(f"{family_of(found.effect)}, of another kind", family - same)]
    return [(named(found.name), own), *instead, *others, ("none of these", 1 - family)]


def equals(found: FoundEffect) -> list[str]:
    """The alternatives that this recording does not distinguish from the effect."""
    return [one.name for one in found.alternatives if one.inseparable]


def either(effects: list[str], name: Callable[[str], str] = named) -> str:
    """Effects called by `name`, with an "or" before the last."""
    *others, last = map(name, effects)
    return f"{', '.join(others)} or {last}" if others else last


def percent(share: float) -> str:
    """A probability [1] in whole percent; never quite none, never quite all."""
    return "< 1 %" if share < LITTLE else "> 99 %" if share > 0.995 else f"{100 * share:.0f} %"


def scored(diagnosis: Diagnosis) -> str:
    """Which data the scores are of, and whether a fit says much of these."""
    return f"{_scored_data(diagnosis)}{LITTLE_CHANGE if hardly_changes(diagnosis) else ''}"


def hardly_changes(diagnosis: Diagnosis) -> bool:
    """What the speed of the data scored changes by is mostly the noise of its readings."""
    score = diagnosis.held_out.before
    return score.fit_percent < 100 * (1 - MOSTLY) and score.chi2_per_sample < 1 / MOSTLY


def _scored_data(diagnosis: Diagnosis) -> str:
    held_out = diagnosis.held_out
    if held_out.in_part:
        whole = [segment for segment in held_out.segments if segment not in held_out.in_part]
        other = f"all of {_segments(whole)} and " if whole else ""
        return f"{other}a third of {_segments(held_out.in_part)}, with the models fitted to the rest"
    if set(held_out.segments) >= set(diagnosis.whole.segments):
        return "all of the estimation data: there are too few to hold any out"
    return f"all of {_segments(held_out.segments)}, with the models fitted to the others"


def _segments(numbers: Sequence[int]) -> str:
    return f"segment{'s' if len(numbers) > 1 else ''} {ranges(numbers)}"


def loop_of(gain: LoopGain) -> str:
    """Which closed loop, and whether the motors know it."""
    loop = gain.before
    known = "no closed loop was fitted" if gain.held_out else "closed loops were fitted: there is nothing else"
    return f"{loop.kind} loop of segment {loop.segment} at {loop.reference_rad_s:.3g} rad/s ({known})"


MOSTLY = 0.7
"""Part of the speed's changes, and of the residual's mean square, that is noise where hardly anything else is."""
LITTLE_CHANGE = "; the speed hardly changes there, so a fit, in percent of its changes, says little"
COMPARED = (
    ("rise_time_s", "rise time", 1e3, "ms"),
    ("final_speed_rad_s", "final speed", 1.0, "rad/s"),
    ("overshoot_percent", "overshoot", 1.0, "%"),
    ("steady_speed_rad_s", "steady speed", 1.0, "rad/s"),
    ("steady_error_rad_s", "steady error", 1.0, "rad/s"),
    ("saturated_percent", "saturated", 1.0, "% of ticks"),
)
"""What is told of a step and a closed loop: attribute, name, factor and unit for people."""
LOOP = (COMPARED[4], COMPARED[2], COMPARED[0])
"""What is told of a closed loop by which motors are compared."""


def compared(found: StepTrials | ClosedLoop) -> list[tuple[str, str, Comparison, float]]:
    """Name, unit, comparison and factor of each of `COMPARED` that `found` has."""
    has = [each for each in COMPARED if hasattr(found, each[0])]
    return [(name, unit, getattr(found, attribute), factor) for attribute, name, factor, unit in has]
