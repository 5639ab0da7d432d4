"""What a diagnosis leaves open: laws that the motor, with the effects named, can imitate."""

import dataclasses

import numpy as np
from jaxtyping import Array

from jaxmotor._precision import to_jax
from jaxmotor.diagnosis._found import Found
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.diagnosis._study import Study
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.estimate import HIDDEN, Allowed, Beside, Fit, Hidden, OpenHypothesis, colour, drives, open_hypotheses
from jaxmotor.motor import Motor
from jaxmotor.motor.effects._base import AbstractDelayEffect

LAWS = dict(
    zip(HIDDEN, ("coulomb_friction", "transport_delay", "dead_zone", "quadratic_drag", "electrical_pole"), strict=True)
)
"""The effects that hidden laws are."""
SMALL = 1e-3
"""Of one unit of a law: the difference over which its column is taken."""
ANOTHER = 0.1
"""Part of gain or pole by which a motor is another one; less is the noise of a recording that would show the law."""
PRIOR = (2, 3)
"""Free numbers of the motor that a prior holds: its electrical time constant and its viscous share."""
SMALLEST_REST = 1e-12
"""Part of a column's square that is left of it for certain: below it there are rounding errors."""


def left_open(
    study: Study, fit: Fit, found: Found, errors: dict[str, float]
) -> tuple[tuple[OpenHypothesis, ...], Allowed | None]:
    """Which laws the recording neither shows nor excludes, and the intervals that allow for them.

    Of the linear motor they are those of `fit`. Beside the effects of `found` each law is let in alone, to first order,
    as a voltage; `errors` are the standard errors of that motor's linear part.
    """
    linear = found.fitted.motor.linear
    motor = np.array([float(linear.gain), float(linear.pole)])
    half = 1.96 * np.array([errors["gain_rad_s_V"], errors["pole_rad_s"]])
    if not found.named:
        return fit.open_hypotheses, None if fit.allowed is None else fit.allowed.spanning(motor, half)
    # What the motor leaves beyond the noise is no chance: it biases an amount taken to first order.
    wider = np.sqrt(colour(study.packed)) * max(found.fitted.chi2, 1.0)
    return open_hypotheses(study.packed, motor, half, Beside((), _beside(study.solver, found.fitted, wider)))


def moves(opened: tuple[OpenHypothesis, ...], motor: Motor) -> bool:
    """Some of `opened` would make gain or pole of `motor` another one."""
    gain, pole = float(motor.linear.gain), float(motor.linear.pole)
    return any(max(abs(one.gain / gain - 1), abs(one.pole / pole - 1)) > ANOTHER for one in opened)


def _beside(solver: Solver, fitted: Fitted, wider: float) -> tuple[Hidden, ...]:
    """Each law that `fitted` has not, alone beside it; errors are `wider` than of white noise."""
    there = {law for effect in fitted.template.effects for law in (effect.name, *effect.contains)}
    columns = _columns(solver, fitted)
    basis, sizes, right = np.linalg.svd(np.delete(fitted.jacobian, PRIOR, axis=1), full_matrices=False)
    inverse = right.T @ np.diag(np.divide(1, sizes, out=np.zeros_like(sizes), where=sizes > 1e-7 * sizes[0]))
    laws = []
    for name, column in zip(HIDDEN, columns, strict=True):
        if LAWS[name] in there or not column.any():
            continue
        along = np.einsum("nk,n->k", basis, column)
        rest = column - basis @ along
        square = max(square_of(rest), SMALLEST_REST * square_of(column))
        amount = -float(np.einsum("n,n->", rest, fitted.residual)) / square
        shift = -(inverse @ along)[:2]
        laws.append(Hidden(name, amount, wider / np.sqrt(square), shift, shift))
    return tuple(laws)


def _columns(solver: Solver, fitted: Fitted) -> list[np.ndarray]:
    """(n,) what one unit of each of `HIDDEN` changes in the residual [standard deviations]."""
    batch = solver.trial.problem.batch
    volts = np.asarray(batch.volts)
    plain, before = solver.residual_of(fitted.motor, fitted.speeds)
    turning = np.where(solver.trial.valid, np.asarray(batch.observed) - plain, 0.0)
    delays = [float(effect.delay()) for effect in fitted.motor.effects if isinstance(effect, AbstractDelayEffect)]
    turning = _earlier(turning, sum(delays) / float(np.median(np.asarray(batch.duration))))
    turning = np.sign(float(fitted.motor.linear.gain)) * turning
    found = []
    for drive in drives(to_jax(volts), to_jax(np.asarray(batch.reset)), to_jax(turning)):
        other = Solver(under(solver.trial, to_jax(volts + SMALL * np.asarray(drive))))
        found.append((other.residual_of(fitted.motor, fitted.speeds)[1] - before) / SMALL)
    return [*found, fitted.jacobian[:, PRIOR[0]]]


def _earlier(rows: np.ndarray, by: float) -> np.ndarray:
    """(sequence, row) `rows` earlier `by` rows: what a torque depends on, as the voltage that acts with it."""
    at = np.arange(rows.shape[1])
    return np.stack([np.interp(at + by, at, sequence, right=0.0) for sequence in rows])


def under(trial: Trial, volts: Array) -> Trial:
    """`trial` with other `volts` (sequence, row)."""
    batch = trial.problem.batch._replace(volts=volts)  # pyright: ignore[reportArgumentType]
    return dataclasses.replace(trial, problem=dataclasses.replace(trial.problem, batch=batch))
