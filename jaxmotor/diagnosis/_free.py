"""A motor as a vector of unconstrained numbers, in which it is fitted.

(log |K|, log a, τ [s], β, then each effect's `to_free`). A recording hardly shows τ = L/R, and β hardly but through
laws of the current: both have a prior, the spread of hobby motors. An effect that adds to τ is all of it: τ is then 0.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float

from jaxmotor._precision import to_jax
from jaxmotor.motor import Motor, SecondOrder
from jaxmotor.motor.effects import (
    OF_LOG,
    AbstractDisturbance,
    AbstractEffect,
    Rig,
    SensorLag,
    free_size,
    parameters,
    to_free,
    values_at,
)
from jaxmotor.motor.effects._base import OWN_LAG_S, AbstractLagEffect, AbstractLagSensorEffect, AbstractLoadEffect
from jaxmotor.prediction import LAG_S

VISCOUS_SHARE = (0.045, 0.02)
"""Mean and spread of the share of the pole that is the rotor's viscous friction, of hobby motors."""
NO_LAG_S = (0.0, 1e-9)
"""Mean and spread of L/R beside such an effect."""
LAG_STEP_S = 3e-6
"""Of L/R, over which residuals are differenced."""
SAME = 0.2
"""Change of the logarithm by which pole and lag are no two."""
OWN = 4
"""Free numbers of the motor without effects."""


class Layout(NamedTuple):
    """What the elements of a free vector are; one element each."""

    names: tuple[str, ...]
    difference: np.ndarray
    """Over which the residuals are differenced."""
    longest: np.ndarray
    """Step that a fit may take at once."""
    low: np.ndarray
    high: np.ndarray
    prior: np.ndarray
    spread: np.ndarray
    """Of the prior; infinite where there is none."""
    ties: np.ndarray | None = None
    """(r, p) rows whose product with the vector is to be zero, weighed; None where there are none."""


def is_possible(motor: Motor, rig: Rig) -> bool:
    """Each of its effects has a size that a motor with its gain can have on `rig`."""
    return not impossible(motor, rig)


def impossible(motor: Motor, rig: Rig) -> list[str]:
    """Its effects that have a size which no motor with its gain has on `rig`."""
    own = rig.of(abs(float(motor.linear.gain)))
    return [effect.name for effect in motor.effects if not effect.possible(own)]


def is_wide(effects: tuple[AbstractEffect, ...]) -> bool:
    """Some law has events that only wide, central differences see."""
    return _are_wide(tuple(map(type, effects)))


def _are_wide(laws: tuple[type[AbstractEffect], ...]) -> bool:
    return any(law.difference > 0.01 for law in laws)


def layout_of(effects: tuple[AbstractEffect, ...], variance: float = 1.0) -> Layout:
    """Of a motor with `effects`; its priors weigh against residuals of that `variance`."""
    layout = _layout_of(tuple(map(type, effects)))
    return layout._replace(spread=layout.spread / math.sqrt(variance))


@functools.lru_cache(256)
def _layout_of(laws: tuple[type[AbstractEffect], ...]) -> Layout:
    inf = np.inf
    wide = 10.0 if _are_wide(laws) else 1.0
    rows = [
        ("gain", 1e-4 * wide, 0.5, -inf, inf, 0.0, inf),
        ("pole", 1e-3 * wide, 0.7, -inf, inf, 0.0, inf),
        ("lag", LAG_STEP_S * wide, 1e-4, 0.0, *((0.0, *NO_LAG_S) if _are_lags(laws) else (OWN_LAG_S, *LAG_S))),
    ]
    rows.append(("viscous_share", 4e-3, 0.05, 0.0, 0.6, *VISCOUS_SHARE))
    for law in laws:
        rows += [(f"{law.name}.{name}", *about) for name, about in _elements(law)]
    names, *columns = zip(*rows, strict=True)
    return Layout(names, *(np.array(column, float) for column in columns))


def _are_lags(laws: tuple[type[AbstractEffect], ...]) -> bool:
    """One of `laws` is the motor's electrical time constant, all of it."""
    return any(issubclass(law, AbstractLagEffect) for law in laws)


def _is_lag(effects: tuple[AbstractEffect, ...]) -> bool:
    return _are_lags(tuple(map(type, effects)))


def _elements(law: type[AbstractEffect]) -> list[tuple[str, tuple[float, ...]]]:
    """Name, difference, longest step, bounds and prior of each free number of an effect."""
    inf = np.inf
    width = law.difference
    found: list[tuple[str, tuple[float, ...]]] = []
    for name, about in parameters(law).items():
        if about["kind"] == "positive":
            found.append((name, (width, 0.7, 0.0 if "least" in about else -18.0, 14.0, 0.0, inf)))
        elif about["kind"] in ("signed", "term"):
            found.append((name, (width * about["scale"], inf, -inf, inf, 0.0, about["spread"])))
        elif about["kind"] == "amplitude":
            sides = (width * about["scale"], inf, -inf, inf, 0.0, inf)
            found += [(name, sides), (f"{name} (across)", sides)]
    return found


def motor_at(template: Motor, free: Float[np.ndarray, " p"]) -> Motor:
    """The motor that `free` stands for; what is not fitted is `template`'s."""
    return to_jax(numbers_at(template, free))


def numbers_at(template: Motor, free: Float[np.ndarray, " p"]) -> Motor:
    """`motor_at` in numpy: to make JAX's arrays of its numbers takes ten times as long."""
    return jax.tree.map(lambda leaf: leaf[0], motors_at(template, free[None]))


def motors_at(template: Motor, frees: Float[np.ndarray, "k p"]) -> Motor:
    """The motors that rows of `frees` stand for, as one whose leaves are (k,), in numpy. Wild ones are infinite."""
    sign = math.copysign(1.0, float(template.linear.gain))
    with np.errstate(over="ignore"):
        leaves, at = [sign * np.exp(frees[:, 0]), np.exp(frees[:, 1]), frees[:, 2]], OWN
    for effect in template.effects:
        size = free_size(effect)
        leaves += values_at(effect, frees[:, at : at + size]).values()
        at += size
    return jax.tree.unflatten(jax.tree.structure(template), [*leaves, frees[:, 3]])


def moved(template: Motor, free: Float[np.ndarray, " p"], steps: Float[np.ndarray, "k p"]) -> Float[np.ndarray, "k p"]:
    """`free` after each of `steps`, to first order their sum.

    A recording shows the pole of rotor and load together, a / (1 + ratio): where the ratio moves, that moves as far as
    the step has it, whatever the size of the step.
    """
    found = free + steps
    for place, effect in enumerate(template.effects):
        if isinstance(effect, AbstractLoadEffect):
            loads = motors_at(template, np.vstack([free, found])).effects[place]
            assert isinstance(loads, AbstractLoadEffect)
            ratio = np.asarray(loads.load().ratio)
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                bend = np.log1p(ratio[1:]) - np.log1p(ratio[0]) - np.log(ratio[1:] / ratio[0]) / (1 + 1 / ratio[0])
            found[:, 1] += np.where(np.isfinite(bend), bend, 0.0)
    return found


def together(motors: Sequence[Motor]) -> Motor:
    """Motors of one structure as one whose leaves are (k,), in numpy."""
    return jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *motors)


def linear_of(
    gain: float,
    pole: float,
    lag: float = LAG_S[0],
    share: float = VISCOUS_SHARE[0],
    effects: tuple[AbstractEffect, ...] = (),
) -> Motor:
    """A motor from plain numbers [rad/s/V, rad/s, s, 1]."""
    gain_, pole_, lag_, share_ = to_jax([np.float64(value) for value in (gain, pole, lag, share)])
    return Motor(SecondOrder(gain_, pole_, lag_), effects, share_)


def free_of(motor: Motor) -> Float[np.ndarray, " p"]:
    """The free vector of `motor`, whose linear part is of second order."""
    linear = motor.linear
    assert isinstance(linear, SecondOrder)
    head = [math.log(abs(float(linear.gain))), math.log(float(linear.pole)), float(linear.electrical_time_constant)]
    return np.concatenate([head, [float(motor.viscous_share)], *(to_free(effect) for effect in motor.effects)])


def with_effect(motor: Motor, effect: AbstractEffect) -> Motor:
    """`motor` with one effect more. A load's inertia comes out of the rotor's."""
    pole = float(motor.linear.pole)
    if isinstance(effect, AbstractLoadEffect):
        pole *= 1 + float(effect.load().ratio)
    assert isinstance(motor.linear, SecondOrder)
    lag = 0.0 if _is_lag((effect,)) else float(motor.linear.electrical_time_constant)
    return linear_of(float(motor.linear.gain), pole, lag, float(motor.viscous_share), (*motor.effects, effect))


def turned_about(motor: Motor) -> Motor | None:
    """`motor` whose pole is its lag, and whose readings lag by its pole; None where it has no such lag, nothing that
    acts between the two, or a load."""
    lags = [effect for effect in motor.effects if _is_turnable(effect)]
    others = [effect for effect in motor.effects if not _is_turnable(effect) and not isinstance(effect, OF_LOG)]
    if len(lags) != 1 or not others or any(isinstance(effect, AbstractLoadEffect) for effect in others):
        return None
    lag, pole = float(lags[0].time_constant_s), float(motor.linear.pole)  # pyright: ignore[reportAttributeAccessIssue]
    if not lag > 0 or abs(math.log(lag * pole)) < SAME:
        return None
    bare = without_effect(motor, lags[0].name)
    faster = linear_of(float(motor.linear.gain), 1 / lag, LAG_S[0], float(motor.viscous_share), bare.effects)
    return with_effect(faster, SensorLag.of(time_constant_s=1 / pole))


def _is_turnable(effect: AbstractEffect) -> bool:
    return isinstance(effect, (AbstractLagEffect, AbstractLagSensorEffect)) and not isinstance(effect, OF_LOG)


def of_motor(motor: Motor) -> Motor:
    """`motor` without what is the log's, and without disturbances."""
    own = tuple(effect for effect in motor.effects if not isinstance(effect, (*OF_LOG, AbstractDisturbance)))
    return motor if len(own) == len(motor.effects) else eqx.tree_at(lambda motor: motor.effects, motor, own)


def with_each(motor: Motor, effects: Sequence[AbstractEffect]) -> Motor:
    """`motor` with each of `effects`, which are of one kind, as one motor whose leaves are (k,), in numpy."""
    first = with_effect(motor, effects[0])
    leaves = [np.repeat(np.asarray(leaf), len(effects)) for leaf in jax.tree.leaves(first)]
    names = tuple(parameters(effects[0]))
    # Leaves are those of the linear part, of the effects in their order, and the viscous share.
    leaves[-1 - len(names) : -1] = [np.array([float(getattr(one, name)) for one in effects]) for name in names]
    if isinstance(effects[0], AbstractLoadEffect):
        ratios = np.array([float(one.load().ratio) for one in effects if isinstance(one, AbstractLoadEffect)])
        leaves[1] = leaves[1] * ((1 + ratios) / (1 + ratios[0]))
    return jax.tree.unflatten(jax.tree.structure(first), leaves)


def without_effect(motor: Motor, name: str) -> Motor:
    """`motor` with one effect less."""
    pole = float(motor.linear.pole)
    for effect in motor.effects:
        if effect.name == name and isinstance(effect, AbstractLoadEffect):
            pole /= 1 + float(effect.load().ratio)
    assert isinstance(motor.linear, SecondOrder)
    kept = tuple(effect for effect in motor.effects if effect.name != name)
    lag = float(motor.linear.electrical_time_constant)
    if _is_lag(motor.effects) and not _is_lag(kept):
        lag = LAG_S[0]
    return linear_of(float(motor.linear.gain), pole, lag, float(motor.viscous_share), kept)
