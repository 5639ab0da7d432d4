"""Both motors in held-out closed loops: how much the effects improve the prediction of a controller."""

import dataclasses

import numpy as np

from jaxmotor._precision import to_jax
from jaxmotor.diagnosis._errors import covariance
from jaxmotor.diagnosis._found import FINE, Found
from jaxmotor.diagnosis._free import motors_at, of_motor
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.diagnosis._split import Part
from jaxmotor.diagnosis._study import Study
from jaxmotor.motor import Motor
from jaxmotor.validation import LoopRun, controller_of, loop_of_motors

MOST = 4
"""Loops that are run."""
MOTORS = 64
"""The fitted one, and draws from its covariance."""


@dataclasses.dataclass(frozen=True, eq=False)
class LoopGain:
    """One closed loop, run by the controller of the recording's header on both motors."""

    before: LoopRun
    after: LoopRun
    held_out: bool
    """Both were fitted without any closed loop; otherwise the recording has nothing else."""


def loop_gains(study: Study, found: Found, seed: int) -> tuple[LoopGain, ...]:
    """Of the closed-loop segments of the recording whose controller is known, and that begin at rest."""
    recording = study.recording
    loops = [index for index, segment in enumerate(recording.segments) if segment.kind == "closed_loop"]
    controllers = {index: controller_of(recording, index) for index in loops if recording.segments[index].at_rest}
    known = [(index, one) for index, one in controllers.items() if not isinstance(one, str)][:MOST]
    if not known:
        return ()
    rows = ~study.rows(tuple(Part(index, range(len(recording.segments[index]))) for index in loops))
    own = bool((study.trial.valid & rows).any())
    solver = Solver(study.trial, rows, study.solver.noise_known) if own else study.solver
    before = _drawn(_refitted(solver, found.linear), study, solver, seed)
    after = before if not found.named else _drawn(_refitted(solver, found.fitted), study, solver, seed)
    gains = []
    for index, controller in known:
        runs = [
            loop_of_motors(motors, recording, index, controller, seed=seed)
            for motors in ([before] if after is before else [before, after])
        ]
        if runs[0] is not None and runs[-1] is not None:
            gains.append(LoopGain(runs[0], runs[-1], own))
    return tuple(gains)


def _refitted(solver: Solver, fitted: Fitted) -> Fitted:
    return solver.fit(fitted.motor, fitted, FINE)


def _drawn(fitted: Fitted, study: Study, solver: Solver, seed: int) -> Motor:
    """A batch: the fitted motor, then draws from its covariance."""
    block = np.asarray(study.packed.batch.cluster).reshape(-1)[solver.cells]
    spread = covariance(fitted, block)
    layout = fitted.layout
    # What is not known at all is left as it is.
    size, axes = np.linalg.eigh(np.where(np.isfinite(spread), spread, 0.0))
    root = axes * np.sqrt(np.maximum(size, 0.0))
    moved = np.random.default_rng(seed).standard_normal((MOTORS - 1, len(size))) @ root.T
    # What is hardly known is not drawn from beyond where a fit would step at once.
    moved = np.clip(moved, -layout.longest, layout.longest)
    frees = np.clip(fitted.free + np.concatenate([np.zeros((1, len(size))), moved]), layout.low, layout.high)
    return to_jax(of_motor(motors_at(fitted.template, frees)))
