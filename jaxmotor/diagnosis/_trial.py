"""A recording as the simulation of motors with effects needs it."""

import dataclasses

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxmotor._precision import to_jax
from jaxmotor.estimate import Packed, Problem, as_problem
from jaxmotor.motor import steps_for
from jaxmotor.motor.effects import Heard, Rig
from jaxmotor.recording import Recording, logs_supply

MEMORY = 0.95
"""Of the filter that residuals pass: twenty ticks, over which a drift of the angle adds up (`drift`)."""
MOST_STEPS = 10
"""Per row: with twice as many no law here changes chi2 by more than 0.003."""


class Trial(eqx.Module):
    """One recording, and what must be known of its rig. Static fields choose the program, arrays are its data."""

    problem: Problem
    time: Float[Array, "lane row"]
    """Since the recording began [s]."""
    angle: Float[Array, "lane row"] | None
    """Measured [rad]; None where it is not known throughout."""
    log: Heard
    row: Int[Array, "lane row"]
    """Which row of the log each row of a lane is."""
    supply: Float[Array, ""]
    """Nominal [V]."""
    steps: Int[Array, ""]
    """Steps per row."""
    used: Int[Array, ""]
    """Rows of the fullest lane; the others are padding."""
    memory: Float[Array, ""]
    """Of the residuals' filter, 0 to 1."""
    lengths: Float[Array, " 2"] | None
    """A typical duration of a row and the longest [s], where rows have durations of their own."""

    @property
    def valid(self) -> Bool[np.ndarray, "lane row"]:
        return np.asarray(self.problem.lanes.valid)

    @property
    def variance(self) -> float:
        """Of a filtered residual if the motor did exactly what the model says [units²].

        A count difference n[k+1] - n[k] of independent errors of variance 1/12 passes 1/(1 - ρ z⁻¹) as
        n[k+1] - (1 - ρ) (n[k] + ρ n[k-1] + ...), of variance 1/(6 (1 + ρ)).
        """
        return 1 / (6 * (1 + float(self.memory))) if self.problem.kind == "turn" else 1 / 12


def trial_of(recording: Recording, packed: Packed, pole_rad_s: float) -> Trial:
    """`packed` segments of `recording`, to be simulated with motors of about this pole."""
    # One program for all recordings of a size: what only estimates need is made equal.
    problem = dataclasses.replace(as_problem(packed), clusters=0, floor_known=True, free=False)
    drifts = packed.observation.kind == "turn" and recording.measured != "speed"
    time = np.zeros(packed.row_of.shape)
    angle = np.zeros(packed.row_of.shape)
    known = _angle_known(recording)
    for index, segment in enumerate(recording.segments):
        cells = packed.segment_of == index
        time[cells] = segment.start_s + packed.time_s[cells]
        if known:
            angle[cells] = _angle(recording, index)[packed.row_of[cells]]
    angle -= angle[packed.segment_of >= 0].min(initial=0.0) // (2 * np.pi) * (2 * np.pi)
    period, longest = packed.durations
    return Trial(
        problem,
        to_jax(time),
        to_jax(angle) if known else None,
        *_log(packed, time, supply_of(recording)),
        to_jax(supply_of(recording)),
        to_jax(np.int32(min(steps_for(period, pole_rad_s), MOST_STEPS))),
        to_jax(np.int32(np.nonzero(packed.segment_of >= 0)[1].max() + 1)),
        to_jax(MEMORY if drifts else 0.0),
        None if packed.lanes.duration.ndim == 0 else to_jax(np.array([period, longest])),
    )


def rig_of(recording: Recording, trial: Trial) -> Rig:
    lanes, speed = trial.problem.lanes, np.abs(np.asarray(trial.log.speed))[: int(np.asarray(trial.log.used))]
    applied = np.unique(np.round(np.abs(np.asarray(lanes.volts)[trial.valid]), 6))
    period = float(np.asarray(trial.log.duration))
    time = np.asarray(trial.time)[trial.valid]
    turns = trial.angle is not None and bool(np.ptp(np.asarray(trial.angle)[trial.valid]) > 2 * np.pi)
    return Rig(
        float(trial.supply),
        tuple(applied[applied > 0].tolist()),
        float(np.quantile(speed, 0.995)),
        period,
        float(np.ptp(time)),
        turns,
        supply_known=recording.supply_V is not None,
        supply_logged=logs_supply(recording),
    )


def supply_of(recording: Recording) -> float:
    """Nominal supply, or the largest voltage that was applied where none is stated [V]."""
    largest = max(float(np.abs(segment.volts).max()) for segment in recording.segments)
    return max(recording.supply_V or 0.0, largest, 1e-3)


def _angle_known(recording: Recording) -> bool:
    if recording.measured == "count":
        return not recording.count_resets
    return recording.measured == "angle" and (len(recording.segments) == 1 or not recording.count_resets)


def _angle(recording: Recording, index: int) -> np.ndarray:
    segment = recording.segments[index]
    if segment.count is not None:
        assert recording.counts_per_rev is not None
        return segment.count * (2 * np.pi / recording.counts_per_rev)
    assert segment.angle_rad is not None
    return segment.angle_rad


def _log(packed: Packed, time: np.ndarray, supply: float) -> tuple[Heard, Int[Array, "lane row"]]:
    """All rows in the order in which they were measured, for what goes on from one experiment to the next."""
    cells = packed.segment_of >= 0
    order = np.argsort(time[cells], kind="stable")
    row, place = np.zeros(cells.shape, np.int32), np.empty(len(order), np.int32)
    place[order] = np.arange(len(order))
    row[cells] = place
    speed, variance = packed.lanes.observed * packed.observation.unit, packed.observation.unit**2 / 12
    duration, _ = packed.durations
    if packed.observation.kind == "turn":
        speed, variance = speed / np.asarray(packed.lanes.duration), 2 * variance / duration**2
    # A tick without a measurement moved about as the one before it.
    speed = np.where(packed.lanes.valid, speed, np.roll(speed, 1, axis=1))
    padding = np.zeros(cells.size - len(order))
    arrays = (array[cells][order] for array in (packed.lanes.volts, speed, time))
    volts, speed, when = (to_jax(np.concatenate([array, padding])) for array in arrays)
    numbers = (to_jax(np.float64(number)) for number in (duration, supply, variance))
    return Heard(volts, speed, when, to_jax(np.int32(len(order))), *numbers), to_jax(row)
