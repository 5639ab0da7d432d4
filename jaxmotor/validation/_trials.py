"""Repeated trials of one step, row by row: what was measured, and what the model would have measured."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key, UInt32

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import Model
from jaxmotor.motor import Motor
from jaxmotor.prediction import Log, Packed, Problem, bucket, pack, predicted_readings
from jaxmotor.recording import Recording, Segment, lost_ticks
from jaxmotor.validation._drawn_motors import draw_motors
from jaxmotor.validation._free_simulation import has_gap, simulate_model, whole_log

BATCH = 32
"""Motors that are simulated side by side."""


@dataclasses.dataclass(frozen=True, eq=False)
class Trials:
    """Segments with the same voltages, and where each of their measurements stands in a common row."""

    segments: tuple[int, ...]
    packed: Packed
    bins: np.ndarray
    """(sequence, row) common row, `size` where there is none."""
    scale: np.ndarray
    """(sequence, row) one unit of what was observed [rad/s]."""
    time_s: np.ndarray
    """(size,) of the common rows [s]."""
    measured: np.ndarray
    """(trial, size) [rad/s], NaN where nothing was measured."""
    floor: np.ndarray
    """(size,) variance of one measurement by the encoder alone [rad²/s²]."""


def group_steps(recording: Recording, segments: tuple[int, ...]) -> list[tuple[int, ...]]:
    """The `step` segments among `segments`, those of equal voltages (and equal start) together.

    A segment that lost more ticks than it has does not show a step.
    """
    groups: dict[tuple, list[int]] = {}
    for index in segments:
        segment = recording.segments[index]
        if segment.kind == "step" and lost_ticks(segment) <= len(segment):
            groups.setdefault(_signature(segment), []).append(index)
    return [tuple(group) for group in groups.values()]


def _signature(segment: Segment) -> tuple:
    """Equal for trials of one experiment, also where some lost ticks or ended earlier."""
    if segment.tick is None:
        return (segment.at_rest, segment.time_s.tobytes(), segment.volts.tobytes())
    changes = np.flatnonzero(np.diff(segment.volts, prepend=np.nan) != 0)
    return (segment.at_rest, segment.tick[changes].tobytes(), segment.volts[changes].tobytes())


def trials_of(recording: Recording, segments: tuple[int, ...], rest_before: bool = False) -> Trials:
    """The trials `segments` (indices), brought to common rows; `rest_before` as for `pack`."""
    packed = pack(recording, segments, rest_before=rest_before)
    used = packed.segment_of >= 0
    bins = np.where(used, packed.row_of, 0)
    for index in segments:
        tick = recording.segments[index].tick
        if tick is not None:
            cells = packed.segment_of == index
            bins[cells] = tick[packed.row_of[cells]]
    valid = packed.batch.valid
    bins -= bins[valid].min()
    size = bucket(int(bins[valid].max()) + 1)
    scale = _scale(packed)
    measured = np.full((len(segments), size), np.nan)
    time_s, floor = np.zeros(size), np.zeros(size)
    for number, index in enumerate(segments):
        cells = valid & (packed.segment_of == index)
        measured[number, bins[cells]] = packed.batch.observed[cells] * scale[cells]
    time_s[bins[valid]] = packed.time_s[valid]
    floor[bins[valid]] = packed.observation.floor * scale[valid] ** 2
    bins = np.where(valid, bins, size).astype(np.int32)
    return Trials(segments, packed, bins, scale, time_s, measured, floor)


def _scale(packed: Packed) -> np.ndarray:
    duration = packed.batch.duration if packed.observation.kind == "turn" else 1.0
    return np.broadcast_to(packed.observation.unit / np.asarray(duration), packed.batch.volts.shape).copy()


def means_of_trials(
    model: Model, recording: Recording, trials: Trials, number: int, key: Key[Array, ""]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(number, size) mean over the trials [rad/s] as the encoder would show it, the same without an encoder, and (k,)
    initial speeds [rad/s].

    The first are of `model` itself, the others of motors drawn around it. Each piece begins at the speed that fits
    `model` best.
    """
    log = whole_log(model.whole, recording, trials.packed)
    speeds = np.zeros(trials.packed.pieces + 1)
    if np.any(trials.packed.batch.free) or has_gap(model.whole):
        speeds, _ = simulate_model(model, recording, trials.packed)
    of_motors, of_encoder = jax.random.split(key)
    keys = jax.random.key_data(jax.random.split(of_encoder, number))
    # Whole batches, so that one is compiled.
    drawn = jax.tree.map(_whole_batches, (draw_motors(model, number, of_motors), keys))
    found = means_program(*drawn, to_jax(speeds), log, to_jax(trials.bins), to_jax(trials.scale), len(trials.time_s))
    return np.asarray(found["encoded"])[:number], np.asarray(found["exact"])[:number], speeds


def _whole_batches(leaf: Array) -> Array:
    size = -(-len(leaf) // BATCH) * BATCH
    return to_jax(np.resize(np.asarray(leaf), (size, *leaf.shape[1:])))


@program
def means_program(
    motors: Motor,
    keys: UInt32[Array, "number 2"],
    speeds: Float[Array, " k"],
    log: Log,
    bins: Int[Array, "sequence row"],
    scale: Float[Array, "sequence row"],
    size: int,
) -> Arrays:
    """`means_of_trials` for as many `motors` as `keys`."""

    def mean(drawn: tuple[Motor, UInt32[Array, " 2"]]) -> tuple[Float[Array, " size"], Float[Array, " size"]]:
        motor, key = drawn[0], jax.random.wrap_key_data(drawn[1])
        return averaged(predicted_readings(motor, speeds, log).T, log.problem, bins, scale, size, key)

    encoded, exact = jax.lax.map(mean, (motors, keys), batch_size=BATCH)
    return {"encoded": encoded, "exact": exact}


def averaged(
    exact: Float[Array, "sequence row"],
    problem: Problem,
    bins: Int[Array, "sequence row"],
    scale: Float[Array, "sequence row"],
    size: int,
    key: Key[Array, ""],
) -> tuple[Float[Array, " size"], Float[Array, " size"]]:
    """Mean over the trials [rad/s] of what `exact` [units] is through an encoder, and of `exact` itself."""
    curves = jnp.stack([as_encoded(exact, problem, key), exact], axis=-1) * scale[..., None]
    sums = jnp.concatenate([curves, jnp.ones_like(curves[..., :1])], axis=-1).reshape(-1, 3)
    sums = jax.ops.segment_sum(sums, bins.reshape(-1), num_segments=size + 1)[:-1]
    encoded, plain = (sums[:, :2] / jnp.maximum(sums[:, 2:], 1.0)).T
    return encoded, plain


def as_encoded(
    exact: Float[Array, "sequence row"], problem: Problem, key: Key[Array, ""]
) -> Float[Array, "sequence row"]:
    """`exact` [units] as a sensor shows it: counts from a random encoder offset for each piece, speeds rounded."""
    if problem.kind != "turn":
        return exact + jax.random.uniform(key, exact.shape, exact.dtype, -0.5, 0.5)
    offset = jax.random.uniform(key, (problem.pieces + 1,), exact.dtype)[jnp.asarray(problem.batch.piece)]
    after = jnp.cumsum(exact, axis=1)
    return jnp.floor(after + offset) - jnp.floor(after - exact + offset)
