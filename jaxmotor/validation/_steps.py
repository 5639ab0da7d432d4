"""Steps: the mean of N trials with its band, against the model with its own (the paper's Fig. 10)."""

import jax
import numpy as np

from jaxmotor.estimate import Model, student_t
from jaxmotor.recording import Recording, Segment
from jaxmotor.validation._response import Response, Rows, measure
from jaxmotor.validation._timed import is_timed
from jaxmotor.validation._trials import Trials, means_of_trials, trials_of
from jaxmotor.validation._validation import Band, Comparison, Interval, StepTrials, limits


def validate_steps(
    model: Model, recording: Recording, segments: tuple[int, ...], key: jax.Array, simulations: int
) -> StepTrials:
    """`segments` (indices), all trials of one step."""
    trials = trials_of(recording, segments, is_timed(model))
    encoded, exact, speeds = means_of_trials(model, recording, trials, simulations + 1, key)
    encoded, nominal = encoded[1:], exact[0]
    present = np.asarray(np.isfinite(trials.measured).any(axis=0))
    mean, half_width = _measured_band(trials, present)
    rows = _rows(trials, recording.segments[segments[0]], present, nominal, speeds)
    measured, predicted = _responses(trials, rows, nominal, encoded)
    low, high = limits(encoded[:, present])
    inside = np.abs(nominal[present] - mean) <= half_width + 1e-12 * np.abs(mean)
    return StepTrials(
        segments=segments,
        amplitude_V=float(recording.segments[segments[0]].volts[_plateau(recording.segments[segments[0]]).start]),
        time_s=trials.time_s[present],
        measured=Band(mean, mean - half_width, mean + half_width),
        predicted=Band(nominal[present], low, high),
        inside_percent=float(100 * inside.mean()),
        rise_time_s=Comparison(_jackknife(measured.rise_time, len(segments)), Interval.of(predicted.rise_time)),
        final_speed_rad_s=Comparison(_jackknife(measured.final, len(segments)), Interval.of(predicted.final)),
    )


def _measured_band(trials: Trials, present: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean over the trials and half its 95 % interval [rad/s].

    Trials may show the same count by chance, so no spread is taken to be less than the encoder's own.
    """
    measured = trials.measured[:, present]
    number = np.isfinite(measured).sum(axis=0)
    mean = np.nanmean(measured, axis=0)
    square = np.nansum((measured - mean) ** 2, axis=0) / np.maximum(number - 1, 1)
    variance = np.maximum(square, trials.floor[present])
    quantile = {int(n): student_t(float(n - 1)) if n > 1 else 1.96 for n in np.unique(number)}
    return mean, np.array([quantile[int(n)] for n in number]) * np.sqrt(variance / number)


def _plateau(segment: Segment) -> slice:
    """Rows of the longest run of one voltage; of equal ones the first."""
    starts = np.flatnonzero(np.diff(segment.volts, prepend=np.nan) != 0)
    lengths = np.diff(starts, append=len(segment))
    longest = int(np.argmax(lengths))
    return slice(int(starts[longest]), int(starts[longest] + lengths[longest]))


def _rows(trials: Trials, segment: Segment, present: np.ndarray, nominal: np.ndarray, speeds: np.ndarray) -> Rows:
    """The rows of the plateau, and the model's speed before it."""
    rows = _plateau(segment)
    begin = segment.time_s[rows.start]
    end = segment.time_s[rows.stop] if rows.stop < len(segment) else np.inf
    tolerance = 1e-9 * float(segment.time_s[-1])
    plateau = present & (trials.time_s >= begin - tolerance) & (trials.time_s < end - tolerance)
    earlier = np.flatnonzero(present & (trials.time_s < begin - tolerance))
    still = segment.at_rest and not segment.volts[: rows.start].any()
    free = trials.packed.batch.piece[trials.packed.batch.free > 0]
    begins_at = speeds[free].mean() if len(free) else 0.0
    initial = 0.0 if still else float(nominal[earlier[-1]] if len(earlier) else begins_at)
    return Rows(trials.time_s, plateau, float(np.median(np.diff(segment.time_s))), initial)


def _responses(trials: Trials, rows: Rows, nominal: np.ndarray, encoded: np.ndarray) -> tuple[Response, Response]:
    """Of the measured mean (first the mean of all trials, then all but one), and of the simulated means."""
    number = len(trials.segments)
    kept = np.concatenate([np.ones((1, number)), 1 - np.eye(number)]) if number > 1 else np.ones((1, 1))
    known = np.isfinite(trials.measured)
    total, weight = kept @ np.where(known, trials.measured, 0.0), kept @ known
    means = np.where(weight > 0, total / np.maximum(weight, 1), nominal)
    every = measure(np.concatenate([nominal[None], encoded, means]), rows)
    begin = 1 + len(encoded)
    return every.of(slice(begin, None)), every.of(slice(1, begin))


def _jackknife(values: np.ndarray, trials: int) -> Interval:
    """`values` of all trials' mean, then of all but one; the interval by how they differ, with Student's t."""
    if trials < 2 or not np.isfinite(values).all():
        return Interval(float(values[0]), float("nan"), float("nan"))
    without = values[1:]
    error = np.sqrt((trials - 1) / trials * ((without - without.mean()) ** 2).sum())
    half = student_t(float(trials - 1)) * error
    return Interval(float(values[0]), float(values[0] - half), float(values[0] + half))
