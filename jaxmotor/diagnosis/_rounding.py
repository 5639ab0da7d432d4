"""What an encoder's rounding makes of the residual, beyond its mean: it repeats itself where the motion does."""

import numpy as np

from jaxmotor.diagnosis._solve import Fitted, Solver, square_of

DRAWS = 39
"""Of where the encoder stands; the largest of so many is exceeded once in forty."""


def rounding_chi2(solver: Solver, fitted: Fitted) -> float:
    """chi2 per sample that rounding alone gives the motor of `fitted` in all but one of forty recordings.

    The motion that it predicts is counted from a random encoder offset in each piece.
    """
    plain, _ = solver.residual_of(fitted.motor, fitted.speeds)
    batch, keep = solver.trial.problem.batch, float(solver.trial.memory)
    valid, piece = np.asarray(batch.valid), np.asarray(batch.piece)
    begins = np.asarray(solver.trial.problem.begins)
    turned = np.where(valid, np.asarray(batch.observed) - plain, 0.0)
    after = np.cumsum(turned, axis=1)
    offsets = np.random.default_rng(0).random((DRAWS, int(piece.max()) + 1))[:, piece]
    error = np.floor(after + offsets) - np.floor(after - turned + offsets) - turned
    error = np.where(valid, error, 0.0)
    drift, before = np.empty_like(error), np.zeros(error.shape[:2])
    for row in range(error.shape[2]):
        before = error[:, :, row] + np.where(begins[:, row], 0.0, keep) * before
        drift[:, :, row] = before
    drift = drift.reshape(DRAWS, -1)[:, solver.cells] * solver.scale
    return max(square_of(one) for one in drift) / max(len(solver.cells), 1)
