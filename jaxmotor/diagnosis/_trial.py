"""A recording to be explained: its log, and what is known of its rig."""

import dataclasses

import numpy as np
from jaxtyping import Array, Float

from jaxmotor._precision import to_jax
from jaxmotor.diagnosis._rest import rest_of
from jaxmotor.motor.effects import Rig
from jaxmotor.prediction import Log, Packed, log_of, shaft_angles
from jaxmotor.recording import Recording, logs_supply

MEMORY = 0.95
"""Of the filter that residuals of counts pass: twenty ticks, over which a drift of the angle adds up (`drift`)."""
MEMORY_S = 1.0
"""The same of angles whose noise is not known: longer than a motor's time constant, whatever the rows' rate."""


class Trial(Log):
    """A log, and how its residuals are weighed."""

    memory: Float[Array, ""]
    """Of the residuals' filter, 0 to 1."""

    @property
    def variance(self) -> float:
        """Of a filtered residual if the motor did exactly what the model says [units²].

        A count difference n[k+1] - n[k] of independent errors of variance 1/12 passes 1/(1 - ρ z⁻¹) as
        n[k+1] - (1 - ρ) (n[k] + ρ n[k-1] + ...), of variance 1/(6 (1 + ρ)).
        """
        return 1 / (6 * (1 + float(self.memory))) if self.problem.kind == "turn" else 1 / 12


def trial_of(recording: Recording, packed: Packed, pole_rad_s: float) -> Trial:
    """`packed` segments of `recording`, to be simulated with motors of about this pole.

    Where the log does not hold at which angles its segments begin, each begins at 0: one program serves it with these
    angles, too, once they are found (`_segment_angles`).
    """
    log = log_of(begun(recording) if shaft_angles(recording) is None else recording, packed, pole_rad_s)
    fields = {field.name: getattr(log, field.name) for field in dataclasses.fields(log)}
    return Trial(**fields, memory=to_jax(_memory(recording, packed)))


def of_means(trial: Trial) -> Trial:
    """`trial`, whose speeds are means over a window that may be none: its programs are those of logs that state one."""
    if trial.problem.kind != "speed":
        return trial
    return dataclasses.replace(trial, problem=dataclasses.replace(trial.problem, kind="window"))


def begun(recording: Recording, angles_rad: np.ndarray | None = None) -> Recording:
    """`recording`, whose segments begin at these angles, or at 0."""
    angles = np.zeros(len(recording.segments)) if angles_rad is None else angles_rad
    runs = zip(recording.segments, angles.tolist(), strict=True)
    segments = tuple(dataclasses.replace(segment, begins_rad=angle) for segment, angle in runs)
    return dataclasses.replace(recording, segments=segments)


def _memory(recording: Recording, packed: Packed) -> float:
    if recording.measured == "angle":
        return float(np.exp(-packed.durations[0] / MEMORY_S))
    return MEMORY if recording.measured == "count" else 0.0


def rig_of(recording: Recording, trial: Trial) -> Rig:
    """What is known of the rig before any fit: what effects may be sought, and how large they may be."""
    batch, log = trial.problem.batch, trial.measured_log
    speed = np.abs(np.asarray(log.speed))[: int(np.asarray(log.used))]
    volts = np.round(np.abs(np.asarray(batch.volts)[trial.valid]), 6)
    applied = np.unique(volts)
    time = np.asarray(trial.time)[trial.valid]
    driven = time[volts > 0]
    angle = None if shaft_angles(recording) is None else trial.angle
    rest_s, slowest_rad_s = rest_of(recording)
    swing = 0.0 if angle is None else float(np.ptp(np.asarray(angle)[trial.valid]))
    return Rig(
        float(trial.supply),
        tuple(applied[applied > 0].tolist()),
        float(np.quantile(speed, 0.995)),
        float(np.asarray(log.duration)),
        float(np.ptp(time)),
        swing > 2 * np.pi,
        supply_known=recording.supply_V is not None,
        supply_logged=logs_supply(recording),
        counts=recording.counts_per_rev is not None,
        swing_rad=swing,
        driven_s=(float(driven.min()), float(driven.max())) if len(driven) else (0.0, 0.0),
        rest_s=rest_s,
        slowest_rad_s=slowest_rad_s,
    )
