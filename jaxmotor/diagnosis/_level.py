"""What a learned curve over the speed leaves to the laws beside it.

A straight line, an offset and Coulomb friction may be parts of the curve or the motor's own: a recording shows their
sum alone. Over the speeds w that it visits the curve g is taken to hold none of them,

    min over p of Σ (g(w) - p0 w - p1 sgn(w) - p2)² at p = 0,

so that gain, pole, friction and offset are those of the motor without the curve that comes nearest. sgn(w) counts
beside friction, 1 beside an offset or a constant load. Where the recording tells them from the curve, as by what
happens near rest, it decides instead (`is_as_likely`). Nearest over all speeds alike would be others: by how much is
part of their errors (`with_convention`).
"""

import numpy as np
from jaxtyping import Float

from jaxmotor.diagnosis._curve_columns import columns_of, visited
from jaxmotor.diagnosis._found import COARSE
from jaxmotor.diagnosis._free import OWN
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor.effects import (
    AbstractEffect,
    AbstractFrictionEffect,
    AbstractLearnedEffect,
    LoadTorque,
    VoltageOffset,
    free_size,
)

FIRMLY = 1e3
"""Weight of p, over that which the rows give the curve's coefficients."""
LIKELY = 4.0
"""Difference of squares, over the variance of blocks of rows."""
EVEN, USUAL = 500, (0.05, 0.95)
"""Speeds either way, between these quantiles: of others the curve is hardly known."""
RESTING = 1e-3
"""Part of the largest speed below which a row says nothing of a sign."""


def with_convention(spread: Float[np.ndarray, "p p"], solver: Solver, fitted: Fitted) -> Float[np.ndarray, "p p"]:
    """The covariance `spread` of the free numbers of `fitted`, wider by what they move where the curve is level over
    all speeds alike."""
    if fitted.ties is None:
        return spread
    ties = ties_of(solver.trial, fitted, even=True)
    moved = solver.fit(fitted.motor, fitted, COARSE, ties=ties).free - fitted.free
    return spread + np.outer(moved, moved) if np.isfinite(moved).all() else spread


def is_as_likely(tied: Fitted, free: Fitted) -> bool:
    """`tied` holds its ties, and what it leaves more than the same laws in `free` is within two standard deviations of
    one parameter."""
    away = 0.0 if tied.ties is None else square_of(tied.ties @ tied.free)
    more = (tied.chi2 - free.chi2) * len(free.residual) + away
    return more < LIKELY * free.variance


def ties_of(trial: Trial, fitted: Fitted, *, even: bool = False) -> Float[np.ndarray, "r p"] | None:
    """Rows whose product with the free numbers of `fitted` is to be zero; None without a curve over the speed. Over the
    speeds that `trial` visits, or over as many `even` ones."""
    begin = OWN
    for effect in fitted.motor.effects:
        if isinstance(effect, AbstractLearnedEffect) and effect.coordinate == "speed":
            speed = visited(trial, effect)
            speed = speed[np.abs(speed) > RESTING * np.abs(speed).max(initial=0.0)]
            if not len(speed):
                return None
            speed = _even(speed) if even else speed
            own = slice(begin, begin + free_size(effect))
            parts = np.linalg.lstsq(_parts(speed, fitted.motor.effects), columns_of(effect, speed), rcond=None)[0]
            ties = np.zeros((len(parts), len(fitted.free)))
            ties[:, own] = FIRMLY * np.linalg.norm(fitted.jacobian[:, own], axis=0).max() * parts
            return ties
        begin += free_size(effect)
    return None


def _even(speed: np.ndarray) -> np.ndarray:
    ways = [np.quantile(way, USUAL) for way in (speed[speed < 0], speed[speed > 0]) if len(way)]
    return np.concatenate([np.linspace(low, high, EVEN) for low, high in ways])


def _parts(speed: np.ndarray, effects: tuple[AbstractEffect, ...]) -> np.ndarray:
    """(n, r) what the curve leaves to others, each of about unit size."""
    parts = [speed / np.abs(speed).max()]
    if any(isinstance(effect, AbstractFrictionEffect) for effect in effects):
        parts.append(np.sign(speed))
    if any(isinstance(effect, VoltageOffset | LoadTorque) for effect in effects):
        parts.append(np.ones_like(speed))
    return np.stack(parts, axis=1)
