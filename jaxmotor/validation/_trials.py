"""Repeated trials of one step, row by row: what was measured, and what the model would have measured."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key

from jaxmotor.prediction import Packed, Problem, as_problem, bucket, pack, predict
from jaxmotor.recording import Recording, Segment, lost_ticks
from jaxmotor.validation._draws import draw_psi
from jaxmotor.validation._follow import follow


@dataclasses.dataclass(frozen=True, eq=False)
class Trials:
    """Segments with the same voltages, and where each of their measurements stands in a common row."""

    segments: tuple[int, ...]
    packed: Packed
    problem: Problem
    bins: np.ndarray
    """(lane, row) common row, `size` where there is none."""
    scale: np.ndarray
    """(lane, row) one unit of what was observed [rad/s]."""
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
    valid = packed.lanes.valid
    bins -= bins[valid].min()
    size = bucket(int(bins[valid].max()) + 1)
    scale = _scale(packed)
    measured = np.full((len(segments), size), np.nan)
    time_s, floor = np.zeros(size), np.zeros(size)
    for number, index in enumerate(segments):
        cells = valid & (packed.segment_of == index)
        measured[number, bins[cells]] = packed.lanes.observed[cells] * scale[cells]
    time_s[bins[valid]] = packed.time_s[valid]
    floor[bins[valid]] = packed.observation.floor * scale[valid] ** 2
    bins = np.where(valid, bins, size).astype(np.int32)
    return Trials(segments, packed, as_problem(packed), bins, scale, time_s, measured, floor)


def _scale(packed: Packed) -> np.ndarray:
    duration = packed.lanes.duration if packed.observation.kind == "turn" else 1.0
    return np.broadcast_to(packed.observation.unit / np.asarray(duration), packed.lanes.volts.shape).copy()


@eqx.filter_jit
def mean_of_trials(
    problem: Problem,
    bins: Int[Array, "lane row"],
    scale: Float[Array, "lane row"],
    size: int,
    psi: Float[Array, " p"],
    root: Float[Array, "m m"],
    number: int,
    key: Key[Array, ""],
) -> tuple[Float[Array, "number size"], Float[Array, "number size"], Float[Array, " k"]]:
    """Mean over the trials [rad/s] as the encoder would show it, and without an encoder; initial speeds [rad/s].

    The first is of the motor ψ itself, the others of motors drawn around it (`root` is that of the covariance).
    Each piece begins at the speed that fits ψ best.
    """
    speeds, _ = follow(problem, psi)
    motors, encoder = jax.random.split(key)

    def draw(both):
        psi, key = both
        return averaged(predict(psi, speeds, problem), problem, bins, scale, size, key)

    drawn = (draw_psi(psi, root, number, motors), jax.random.split(encoder, number))
    return *jax.lax.map(draw, drawn, batch_size=32), speeds


def averaged(
    exact: Float[Array, "lane row"],
    problem: Problem,
    bins: Int[Array, "lane row"],
    scale: Float[Array, "lane row"],
    size: int,
    key: Key[Array, ""],
) -> tuple[Float[Array, " size"], Float[Array, " size"]]:
    """Mean over the trials [rad/s] of what `exact` [units] is through an encoder, and of `exact` itself."""
    curves = jnp.stack([as_encoded(exact, problem, key), exact], axis=-1) * scale[..., None]
    sums = jnp.concatenate([curves, jnp.ones_like(curves[..., :1])], axis=-1).reshape(-1, 3)
    sums = jax.ops.segment_sum(sums, bins.reshape(-1), num_segments=size + 1)[:-1]
    encoded, plain = (sums[:, :2] / jnp.maximum(sums[:, 2:], 1.0)).T
    return encoded, plain


def as_encoded(exact: Float[Array, "lane row"], problem: Problem, key: Key[Array, ""]) -> Float[Array, "lane row"]:
    """`exact` [units] as a sensor shows it: counts from a random encoder offset for each piece, speeds rounded."""
    if problem.kind != "turn":
        return exact + jax.random.uniform(key, exact.shape, exact.dtype, -0.5, 0.5)
    offset = jax.random.uniform(key, (problem.pieces + 1,), exact.dtype)[jnp.asarray(problem.lanes.piece)]
    after = jnp.cumsum(exact, axis=1)
    return jnp.floor(after + offset) - jnp.floor(after - exact + offset)
