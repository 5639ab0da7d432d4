"""When the rows of a log were read, beside a motor with effects.

To first order a reading that comes a share s of a row late has seen s (u_(k+1) - u_k) more in its row, one that comes
early s (u_(k-1) - u_k). Where what the motor leaves has much of either, the timing offset is fitted with the motor.
"""

import dataclasses

import numpy as np

from jaxmotor._precision import to_jax
from jaxmotor.diagnosis._found import FINE
from jaxmotor.diagnosis._free import with_effect
from jaxmotor.diagnosis._left_open import PRIOR, SMALL, under
from jaxmotor.diagnosis._score_test import without_own
from jaxmotor.diagnosis._solve import Fitted, Solver, block_variance, square_of
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._timed import offset_of
from jaxmotor.diagnosis._window import LAG
from jaxmotor.estimate import EVIDENCE, MOST_ROWS
from jaxmotor.motor.effects import OF_LOG, TimingOffset


def with_timing_offset(study: Study, fitted: Fitted) -> tuple[Study, Fitted] | None:
    """The readings of `study`, packed for motors with a timing offset, and `fitted` with that. None where it is stated,
    where it is not told from none, or from a lag of the motor."""
    stated = study.recording.duty_delay_s is not None or study.timed
    if stated or any(effect.family == LAG or isinstance(effect, OF_LOG) for effect in fitted.motor.effects):
        return None
    rows, gain = _promised(study.solver, fitted)
    if not gain > EVIDENCE:
        return None
    noise, request = study.packed.observation.noise, study.solver.request
    timed = study_of(study.recording, study.pole_rad_s, True, request, noise)
    still = timed.solver.fit(fitted.motor, fitted, FINE, ties=fitted.ties)
    offset = TimingOffset.of(offset_s=rows * study.packed.durations[0])
    ties = None if fitted.ties is None else np.pad(fitted.ties, ((0, 0), (0, 1)))
    moved = timed.solver.fit(with_effect(fitted.motor, offset), fitted, FINE, ties=ties)
    gain = square_of(still.residual) - square_of(moved.residual)
    return (timed, moved) if is_near(timed, moved) and gain > EVIDENCE * moved.variance else None


def is_near(study: Study, fitted: Fitted) -> bool:
    """Its timing offset is one that can be: a reading further off belongs to another row."""
    return abs(offset_of(fitted.motor)) < MOST_ROWS * study.packed.durations[0]


def _promised(solver: Solver, fitted: Fitted) -> tuple[float, float]:
    """The offset [rows], late or early, that lowers the sum of squares most to first order, and by how much, in the
    variance that blocks of rows then have. L/R is held: to first order a smaller one looks like late readings, but none
    is below zero."""
    jacobian = fitted.jacobian.copy()
    jacobian[:, PRIOR] = 0.0
    kept = dataclasses.replace(fitted, jacobian=jacobian)
    batch = solver.trial.problem.batch
    volts, reset = np.asarray(batch.volts), np.asarray(batch.reset)
    before = np.where(reset, 0.0, np.pad(volts[:, :-1], ((0, 0), (1, 0))))
    after = np.pad(np.where(reset, 0.0, volts)[:, 1:], ((0, 0), (0, 1)))
    own = solver.residual_of(fitted.motor, fitted.speeds)[1]
    left, best = without_own(kept, own), (0.0, 0.0)
    for way, drive in ((1.0, after - volts), (-1.0, before - volts)):
        other = Solver(under(solver.trial, to_jax(volts + SMALL * drive)))
        column = without_own(kept, (other.residual_of(fitted.motor, fitted.speeds)[1] - own) / SMALL)
        square, along = square_of(column), -float(np.einsum("n,n->", column, left))
        if square > 0 and along > 0:
            rest = left + along / square * column
            gain = along**2 / square / block_variance(rest, jacobian, solver.block)
            best = max(best, (way * along / square, gain), key=lambda one: one[1])
    return float(np.clip(best[0], -MOST_ROWS, MOST_ROWS)), best[1]
