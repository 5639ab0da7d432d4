"""A recording as arrays of one shape: its segments packed end to end into a few sequences.

Segments differ in length; a scan over a padded block would be mostly padding, and a new shape for each
recording a new compilation. A *piece* is a run of rows without a lost tick; pieces are packed into at most
`SEQUENCES` sequences, and lengths are rounded up to 2^k or 1.5 2^k.
"""

import dataclasses
from typing import Literal, NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor.prediction._flexible_model import LogRows, late
from jaxmotor.prediction._noise import Noise, estimated, rounding, unknown
from jaxmotor.recording import Recording, Segment, at_duty, is_steady, pulse_windows

SEQUENCES = 16
"""Side by side at most, where nobody asks for more."""


class Batch(NamedTuple):
    """Arrays (sequence, row); a row that holds nothing has `valid` false and the number of pieces as `piece`."""

    volts: np.ndarray
    """Held from this row to the next [V]."""
    reset: np.ndarray
    """The first row of a piece."""
    free: np.ndarray
    """1.0 at the first row of a piece whose initial speed is not known, else 0."""
    duration: np.ndarray
    """Time to the next row [s]; one number where all are equal."""
    observed: np.ndarray
    """What was measured [units of `Observation.unit`]."""
    valid: np.ndarray
    """`observed` holds a measurement."""
    piece: np.ndarray
    """Index of the piece."""
    cluster: np.ndarray
    """Index of the block of rows whose errors are taken as one when errors are judged between blocks."""
    back: np.ndarray
    """Rows back to the row in which the speed's window begins (`window` observations only)."""
    part: np.ndarray
    """Time from that row to the beginning of the window [s]."""
    span: np.ndarray
    """Length of the row's window over `Observation.window_s` [1]; one number where all are equal."""


@dataclasses.dataclass(frozen=True)
class Observation:
    """How `Batch.observed` came from the motion, and how well."""

    kind: Literal["turn", "speed", "window"]
    """Angle turned until the next row; speed at the row; mean speed over `window_s` before the row."""
    unit: float
    """One unit of `Batch.observed` in rad (turn) or rad/s: the encoder's count, or what makes `floor` the noise."""
    floor: float
    """Variance of one observation in units squared if the motor did exactly what the model says [1]."""
    noise: Noise
    """Of one reading."""
    window_s: float = 0.0
    """Length of the window [s]."""

    @property
    def floor_known(self) -> bool:
        """The floor follows from the encoder; otherwise it was estimated from the data."""
        return self.noise.known


@dataclasses.dataclass(frozen=True)
class Packed:
    """A recording ready to be fitted, and the way back to its rows."""

    batch: Batch
    observation: Observation
    pieces: int
    """Number of pieces, rounded up to a power of two."""
    clusters: int
    """Number of clusters, rounded up to a power of two."""
    segment_of: np.ndarray
    """(sequence, row) index of the segment in the recording, -1 where there is none."""
    row_of: np.ndarray
    """(sequence, row) index of the row within its segment."""
    time_s: np.ndarray
    """(sequence, row) since the segment's first row [s]."""

    def __len__(self) -> int:
        return int(self.batch.valid.sum())

    @property
    def durations(self) -> tuple[float, float]:
        """The median and the longest duration of rows that another one of their segment follows [s]."""
        durations = self.batch.duration
        if durations.ndim:
            follows = (self.segment_of[:, :-1] >= 0) & (self.segment_of[:, :-1] == self.segment_of[:, 1:])
            durations = durations[:, :-1][follows]
        return float(np.median(durations)), float(np.max(durations))


class Piece(NamedTuple):
    segment: int
    rows: slice
    free: bool
    rest: bool = False
    """A row of rest, in which nothing was measured, comes before its first."""


class Padding(NamedTuple):
    """Shapes that are rounded up to few: simulations stop after the rows in use, but arrays have all of them."""

    sequences: int
    rows: tuple[int, ...]
    """The fewest; more than these are 2^k or 1.5 2^k."""
    pieces: int
    """The fewest; more come by factors of two."""


PADDED = Padding(16, (512, 2048, 8192), 64)
SHORT_BATCHES, SHORT_ROWS, SHORT_PIECES = (1, 4, 16), (512, 1024, 2048), 64
"""Sizes of short recordings for programs that compute all rows: they do so in less time than to compile one takes."""


def pack(
    recording: Recording,
    segments: tuple[int, ...],
    padding: Padding | None = None,
    rest_before: bool = False,
    few_shapes: bool = False,
    noise: Noise | None = None,
) -> Packed:
    """The `segments` (indices) of `recording` as sequences. Numpy only; nothing is fitted.

    `padding` asks for one of few shapes, `few_shapes` for the same of short recordings only, with the pieces where they
    would be without. With `rest_before` a row of rest comes before pieces that are driven from their first row on:
    readings that are late show in it what that row does before it is read. `noise` is that of a reading where it has
    been estimated before.
    """
    found = _packed(recording, segments, padding, rest_before, few_shapes)
    return found if found.observation.floor_known else _in_noise(recording, found, segments, noise)


def log_rows(recording: Recording, segments: tuple[int, ...]) -> LogRows:
    """The rows of the `segments` (indices) of `recording`, one piece after the other [1 rad or 1 rad/s]."""
    return _log_rows(_packed(recording, segments))


def _packed(
    recording: Recording,
    segments: tuple[int, ...],
    padding: Padding | None = None,
    rest_before: bool = False,
    few_shapes: bool = False,
) -> Packed:
    """As `pack`, in units of 1 rad or 1 rad/s where the noise is not known."""
    observation = _observation(recording)
    pieces = [piece for index in segments for piece in pieces_of(recording, index)]
    if rest_before:
        pieces = [piece._replace(rest=_driven_at_once(recording, piece)) for piece in pieces]
    sequence_of, start_of, length = _place([_size(piece) for piece in pieces], padding.sequences if padding else None)
    shape = (max(sequence_of) + 1, bucket(length))
    if padding:
        shape = padding.sequences, next((rows for rows in padding.rows if rows >= length), shape[1])
    number_of_pieces = max(_power_of_two(len(pieces)), padding.pieces if padding else 1)
    blocks, number_of_blocks = _blocks(pieces)
    clusters = _power_of_two(number_of_blocks)
    if few_shapes and length <= SHORT_ROWS[-1]:
        batch, rows = shape
        shape = min(size for size in SHORT_BATCHES if size >= batch), min(size for size in SHORT_ROWS if size >= rows)
        number_of_pieces, clusters = max(number_of_pieces, SHORT_PIECES), max(clusters, SHORT_PIECES)
    packed = Batch(
        volts=np.zeros(shape),
        reset=np.zeros(shape, bool),
        free=np.zeros(shape),
        duration=np.ones(shape) if recording.period_s is None else np.asarray(recording.period_s),
        observed=np.zeros(shape),
        valid=np.zeros(shape, bool),
        piece=np.full(shape, number_of_pieces, np.int32),
        cluster=np.full(shape, clusters, np.int32),
        back=np.zeros(shape, np.int32),
        part=np.zeros(shape),
        span=np.ones(() if _has_equal_windows(recording) else shape),
    )
    segment_of, row_of, time_s = np.full(shape, -1), np.zeros(shape, int), np.zeros(shape)
    for number, (piece, sequence, start) in enumerate(zip(pieces, sequence_of, start_of, strict=True)):
        segment = recording.segments[piece.segment]
        _fill(packed, (sequence, slice(start + piece.rest, start + _size(piece))), recording, piece, observation)
        if is_steady(segment):
            packed.valid[sequence, start : start + _size(piece) // 2] = False
        cells = (sequence, slice(start, start + _size(piece)))
        rows = np.maximum(np.arange(piece.rows.start - piece.rest, piece.rows.stop), piece.rows.start)
        packed.reset[cells] = np.arange(len(rows)) == 0
        packed.piece[cells] = number
        packed.cluster[cells] = blocks[piece.segment].of(rows)
        segment_of[cells] = piece.segment
        row_of[cells] = rows
        time_s[cells] = segment.time_s[rows]
        if piece.rest and packed.duration.ndim:
            packed.duration[sequence, start] = packed.duration[sequence, start + 1]
    return Packed(packed, observation, number_of_pieces, clusters, segment_of, row_of, time_s)


def _fill(batch: Batch, cells: tuple[int, slice], recording: Recording, piece: Piece, observation: Observation) -> None:
    segment, rows = recording.segments[piece.segment], piece.rows
    time = segment.time_s[rows]
    batch.volts[cells] = segment.volts[rows]
    batch.free[cells[0], cells[1].start] = float(piece.free)
    if batch.duration.ndim:
        batch.duration[cells] = np.diff(time, append=time[-1] + 1.0)
    if observation.kind == "turn":
        all_but_last = (cells[0], slice(cells[1].start, cells[1].stop - 1))
        batch.observed[all_but_last] = _turned(recording, segment, time, rows, observation.unit)
        batch.valid[all_but_last] = _turns_read(segment)[rows][:-1]
        return
    assert segment.speed_rad_s is not None
    batch.observed[cells] = at_duty(recording, segment.speed_rad_s[rows], time) / observation.unit
    window, read = np.full(len(time), observation.window_s), segment.read[rows]
    if recording.speed_pulses_per_rev is not None:
        window, fresh = (one[rows] for one in pulse_windows(segment, recording.speed_pulses_per_rev))
        read = read & fresh
        batch.span[cells] = window / observation.window_s
    elif recording.speed_window_rows is not None and batch.span.ndim:
        number = recording.speed_window_rows
        window = rows_span(time, number, observation.window_s) if number else _since_reading(segment)[rows]
        batch.span[cells] = window / observation.window_s
    begin = np.maximum(time - window, time[0])
    row = np.clip(np.searchsorted(time, begin + 1e-9 * observation.window_s, side="right") - 1, 0, None)
    batch.back[cells] = np.arange(len(time)) - row
    batch.part[cells] = np.maximum(begin - time[row], 0.0)
    # Before a piece that begins at rest the shaft stood still.
    batch.valid[cells] = read & (not piece.free or time - time[0] >= window * (1 - 1e-9))


def _turns_read(segment: Segment) -> np.ndarray:
    """(n,) whether the turn from each row to the next was read: of mean speeds in that one, of angles in both."""
    after = np.append(segment.read[1:], False)
    return after if segment.speed_rad_s is not None else after & segment.read


def _has_equal_windows(recording: Recording) -> bool:
    uneven = recording.period_s is None or recording.speed_window_rows == 0
    return not uneven and recording.speed_pulses_per_rev is None


def _since_reading(segment: Segment) -> np.ndarray:
    """(n,) time from the last row before each that was read, or from the first of `segment`, to it [s]; of the first
    row a positive one."""
    time, place = segment.time_s, np.maximum.accumulate(np.where(segment.read, np.arange(len(segment)), 0))
    since = time - time[np.concatenate([[0], place[:-1]])]
    since[0] = time[1] - time[0]
    return since


def rows_span(time: np.ndarray, number: int, usual_s: float) -> np.ndarray:
    """(n,) time from `number` rows before each row to it [s]; rows before the first are `usual_s` / `number` apart."""
    before = time[0] + usual_s / number * np.arange(-number, 0)
    return time - np.concatenate([before, time])[: len(time)]


def _turned(recording: Recording, segment: Segment, time: np.ndarray, rows: slice, unit: float) -> np.ndarray:
    """Turned from each row's voltage to the next one's [`unit` rad; counts are their own unit]."""
    if segment.count is not None:
        # From the first on: a running counter may be beyond what floats hold exactly.
        return np.diff(at_duty(recording, segment.count[rows] - segment.count[rows.start], time))
    if segment.angle_rad is not None:
        return np.diff(at_duty(recording, segment.angle_rad[rows], time)) / unit
    assert segment.speed_rad_s is not None
    return at_duty(recording, segment.speed_rad_s[rows], time)[1:] * np.diff(time) / unit


def pieces_of(recording: Recording, index: int) -> list[Piece]:
    """Runs of rows without a lost tick: what was applied in one is not known, so neither is the speed after it.

    Rest before the first voltage says nothing about the motor, only one rounding error many times over: one
    row of it is kept. To a steady state the motor comes from rest: it would stay at any initial speed if it were slow.
    """
    segment = recording.segments[index]
    first, free = 0, not (segment.at_rest or is_steady(segment))
    if segment.at_rest:
        # The first that is not zero, or the first of all.
        first = max(int(np.argmax(segment.volts != 0.0)) - 1, 0)
    breaks = [first]
    if segment.tick is not None and segment.tick[-1] - segment.tick[0] >= len(segment):
        breaks += [int(row) for row in np.flatnonzero(np.diff(segment.tick) > 1) + 1 if row > first]
    ends = [*breaks[1:], len(segment)]
    pieces = [Piece(index, slice(begin, end), free or begin > first) for begin, end in zip(breaks, ends, strict=True)]
    return [piece for piece in pieces if _size(piece) >= 2]


def _driven_at_once(recording: Recording, piece: Piece) -> bool:
    return not piece.free and bool(recording.segments[piece.segment].volts[piece.rows.start] != 0.0)


def _size(piece: Piece) -> int:
    return piece.rows.stop - piece.rows.start + piece.rest


def _place(sizes: list[int], batch: int | None) -> tuple[list[int], list[int], int]:
    """Sequence and first row of each piece, and the rows of the fullest sequence; the longest are placed first."""
    count = batch or max(1, min(SEQUENCES, sum(sizes) // max(sizes)))
    load = [0] * count
    sequence_of, start_of = [0] * len(sizes), [0] * len(sizes)
    for number in sorted(range(len(sizes)), key=lambda number: -sizes[number]):
        sequence = load.index(min(load))
        sequence_of[number], start_of[number] = sequence, load[sequence]
        load[sequence] += sizes[number]
    return sequence_of, start_of, max(load)


def up_by_four(least: int, size: int) -> int:
    """The first of `least`, 4 `least`, 16 `least`, ... that holds `size`."""
    while least < size:
        least *= 4
    return least


def bucket(size: int) -> int:
    power = _power_of_two(max(size, 64))
    return power * 3 // 4 if size <= power * 3 // 4 else power


def _power_of_two(size: int) -> int:
    return 1 << max(size - 1, 0).bit_length()


class _Blocks(NamedTuple):
    """A segment cut into equal parts."""

    number: int
    """Of the first part."""
    parts: int
    first: int
    """Row."""
    rows: int

    def of(self, rows: np.ndarray) -> np.ndarray:
        """The part in which each of `rows` is."""
        return self.number + (rows - self.first) * self.parts // self.rows


def _blocks(pieces: list[Piece]) -> tuple[dict[int, _Blocks], int]:
    """Blocks of rows, and their number: whole segments if there are ten, else segments cut into equal parts of 20 rows
    up."""
    used: dict[int, list[Piece]] = {}
    for piece in sorted(pieces, key=lambda piece: piece.segment):
        used.setdefault(piece.segment, []).append(piece)
    most = -(-10 // len(used)) if len(used) < 10 else 1
    blocks, number = {}, 0
    for segment, own in used.items():
        first, last = own[0].rows.start, own[-1].rows.stop
        parts = max(1, min(most, sum(map(_size, own)) // 20))
        blocks[segment] = _Blocks(number, parts, first, last - first)
        number += parts
    return blocks, number


def _observation(recording: Recording) -> Observation:
    """How `recording` was measured; one unit of a log without counts is 1 rad or 1 rad/s until its noise is known."""
    if recording.measured == "count":
        return Observation("turn", recording.count_rad, 1 / 6, rounding(recording))
    window, period = recording.speed_window_s or 0.0, recording.period_s
    # The mean over the previous tick is what a count difference is: neighbours share a rounding error.
    over_tick = period is not None and abs(window - period) < 1e-6 * period and _has_equal_windows(recording)
    if recording.measured == "angle" or over_tick:
        return Observation("turn", 1.0, 1 / 6, unknown(recording), window if over_tick else 0.0)
    return Observation("window" if window else "speed", 1.0, 1 / 12, unknown(recording), window)


def _in_noise(recording: Recording, packed: Packed, segments: tuple[int, ...], noise: Noise | None) -> Packed:
    """`packed` in units in which the noise has the variance `Observation.floor`."""
    observation = packed.observation
    rows = _log_rows(packed)
    if noise is None and rows.turn and not rows.valid.any():
        raise JaxmotorError(
            f"{recording.name}: no two rows next to each other have a reading, so no turn is known; import the log "
            "again (jaxmotor import), which then keeps the rows with a reading"
        )
    if noise is None and not rows.valid.any():
        raise JaxmotorError(
            f"{recording.name}: no reading is left whose window of {observation.window_s:g} s lies within its segment; "
            "check speed_window_s, which is in seconds (jaxmotor import: --speed-window)"
        )
    noise = noise or estimated(recording, segments, rows)
    # A mean speed over a tick is taken as a turn.
    per_level = float(np.median(rows.duration[rows.valid])) if rows.turn and recording.measured == "speed" else 1.0
    unit = noise.level * per_level / np.sqrt(observation.floor)
    batch = packed.batch._replace(observed=packed.batch.observed / unit)
    observation = dataclasses.replace(observation, unit=unit, noise=noise)
    return dataclasses.replace(packed, batch=batch, observation=observation)


def delayed(packed: Packed, delay_s: float) -> Packed:
    """`packed` with voltages that act `delay_s` later: in each row their mean over its time (`late`), and none before
    the first row of a segment. Numpy only."""
    used, order = _in_order(packed)
    rows = _log_rows(packed)
    rows = rows._replace(free=np.where(packed.row_of[used][order] == 0, 0.0, rows.free))
    volts = np.zeros(len(order))
    volts[order] = late(rows, delay_s)
    batch = packed.batch._replace(volts=packed.batch.volts.copy())
    batch.volts[used] = volts
    return dataclasses.replace(packed, batch=batch)


def _in_order(packed: Packed) -> tuple[np.ndarray, np.ndarray]:
    """(sequence, row) which rows are the log's, and the order of their pieces in that."""
    used = packed.segment_of >= 0
    return used, np.argsort(packed.batch.piece[used], kind="stable")


def _log_rows(packed: Packed) -> LogRows:
    """The rows of `packed` [1 rad or 1 rad/s], one piece after the other as the recording has them: what drifts in its
    course does so here, wherever pieces were placed."""
    batch, turn = packed.batch, packed.observation.kind == "turn"
    used, order = _in_order(packed)

    def rows(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values, used.shape)[used][order]

    speed, duration, valid = rows(batch.observed), rows(batch.duration), rows(batch.valid)
    is_window = packed.observation.kind == "window"
    return LogRows(
        volts=rows(batch.volts),
        reset=rows(batch.reset),
        free=rows(batch.free),
        duration=duration,
        speed=np.where(valid, speed / duration if turn else speed, 0.0),
        valid=valid,
        back=rows(batch.back),
        part=rows(batch.part),
        turn=turn,
        window_s=packed.observation.window_s * rows(batch.span) if is_window else np.zeros(len(order)),
    )
