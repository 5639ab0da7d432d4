"""What the voltages explain of a log at most: the residual of the best flexible model. Numpy only.

The noise of a log of speeds or angles is what no motor explains. Motors are many, so it is taken from sums of
first-order responses (`responses`) to the voltage and to what the usual laws make of it: friction and rest, dead zone
and saturation, drag, a coasting bridge, a drift. Errors of neighbouring rows need not be independent: blocks of rows
are left out of the fit, each in turn, and predicted,

    e_b + J_b (JᵀJ - J_bᵀJ_b)⁻¹ J_bᵀ e_b

(e residual, J columns). Where the fit takes up the part p of the noise, the mean square residual is σ²(1 - p), that of
blocks left out σ²(1 + p), and their mean is σ². The set of columns with the least of these means is kept.
"""

import math
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.motor.effects import LONGEST_DELAY_S

POLES = 24
"""That are tried at first."""
DELAYS = (0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233, 377, 610)
"""Rows, of the typical duration, by which the voltage may come late: the first nine, and more up to
`LONGEST_DELAY_S`."""
BETWEEN = 9
"""Delays that are tried between the best one's neighbours."""
BLOCKS = 20
"""Of rows, each of which is left out in turn."""
ROWS_PER_COLUMN = 5
"""The fewest."""
WORST = 4.0
"""Times its mean square residual, which the error of blocks left out is taken to be at most: a block that holds the
only rows of their kind is predicted badly, whatever the noise."""


HELD = 10
"""Equal readings in a row that are one reading held, not a speed that hardly changes."""


class LogRows(NamedTuple):
    """(n,) rows of all pieces of a log, one piece after the other; as in `Batch`."""

    volts: np.ndarray
    reset: np.ndarray
    free: np.ndarray
    duration: np.ndarray
    speed: np.ndarray
    """Measured speed [rad/s]: from the row to the next one (turn), at the row, or the mean over the window."""
    valid: np.ndarray
    back: np.ndarray
    part: np.ndarray
    turn: bool
    window_s: np.ndarray

    def first(self, number: int) -> "LogRows":
        """The first rows."""
        return self._replace(**{name: value[:number] for name, value in self._asdict().items() if name != "turn"})

    @property
    def piece(self) -> np.ndarray:
        """Number of the piece of each row."""
        return np.cumsum(self.reset) - 1

    @property
    def typical_s(self) -> float:
        """Median duration of rows that hold a reading [s]."""
        return float(np.median(self.duration[self.valid]))

    @property
    def still(self) -> np.ndarray:
        """Rows whose reading says that the shaft does not turn."""
        return self.valid & (np.abs(self.speed) < 1e-9 * np.abs(self.speed).max(initial=0.0))

    @property
    def counts(self) -> np.ndarray:
        """Rows that say something about the noise: neither rest nor one reading held over many rows."""
        still = self.still
        rest = still & np.append(still[1:], True) & np.insert(still[:-1], 0, True)
        same = np.abs(np.diff(self.speed)) < 1e-9 * np.abs(self.speed).max(initial=0.0)
        begin = np.flatnonzero(np.insert(~same, 0, True) | self.reset)
        run = np.diff(np.append(begin, len(same) + 1))
        held = np.repeat(run, run) > HELD
        held[begin] = False
        return self.valid & ~rest & ~held


class Flexible(NamedTuple):
    """The residual of the flexible model."""

    level: float
    """Its standard deviation, freed of the number of columns [rad/s]."""
    residual: np.ndarray
    """(n,) measured minus fitted [rad/s], zero where there is no reading."""


def first_order(
    rows: LogRows, drives: np.ndarray, poles: np.ndarray, start: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """(n, c) speed at the rows, and turn until the next one, of first-order lags x' = p (d - x) under (n, c) `drives`
    held over rows.

    `poles` (c,) [rad/s]; pieces begin at `start`, a number or (n,), where their initial speed is not known, else at 0.
    """
    start = np.broadcast_to(start, len(drives))
    poles = _once(poles)
    decay = np.exp(-rows.duration[:, None] * poles)
    inject = drives * (1 - decay)
    ends = np.append(rows.reset[1:], True)
    decay_or_end, inject[ends] = np.where(ends[:, None], 0.0, decay), 0.0
    begins = np.append((start * rows.free * rows.reset)[1:], 0.0)
    inject[ends] += begins[ends, None]
    speed = states(decay_or_end, inject, np.full(drives.shape[1], start[0] * rows.free[0]))
    return speed, drives * rows.duration[:, None] + (speed - drives) * (1 - decay) / poles


def _once(poles: np.ndarray) -> np.ndarray:
    """(c,) `poles`; (1,) where all are equal."""
    return poles[:1] if (poles == poles[0]).all() else poles


def states(decay: np.ndarray, inject: np.ndarray, first: np.ndarray) -> np.ndarray:
    """(n, c) x of x[k+1] = decay[k] x[k] + inject[k] (n, c), from the `first` (c,); `decay` (n, c) or (n, 1).

    About √n blocks of rows side by side, each from zero; then what each block ends with goes into the next one.
    """
    size = max(math.isqrt(len(decay)), 1)
    # Blocks come last but one: (row in block, block, c).
    split = [_blocks(one, size, fill) for one, fill in ((decay, 1.0), (inject, 0.0))]
    states, kept = np.empty_like(split[1]), np.ones_like(split[0])
    now = np.zeros(states.shape[1:])
    for row, (by, more) in enumerate(zip(*split, strict=True)):
        states[row] = now
        now = by * now + more
    np.cumprod(split[0][:-1], axis=0, out=kept[1:])
    passed, begins = kept[-1] * split[0][-1], np.empty_like(now)
    for block in range(len(begins)):
        begins[block] = first
        first = now[block] + passed[block] * first
    states += kept * begins
    return states.swapaxes(0, 1).reshape(-1, states.shape[-1])[: len(decay)]


def _blocks(values: np.ndarray, size: int, fill: float) -> np.ndarray:
    """`values` (n, c) as (size, blocks, c), filled up."""
    short = -len(values) % size
    filled = np.concatenate([values, np.full((short, values.shape[1]), fill)]) if short else values
    return np.ascontiguousarray(filled.reshape(-1, size, values.shape[1]).swapaxes(0, 1))


def responses(rows: LogRows, drives: np.ndarray, poles: np.ndarray, start: float = 0.0) -> np.ndarray:
    """(n, c) speed as the log would show it of `first_order` lags.

    Exact for uneven rows and for means over a window: x and its integral at any time follow from x and d at the row
    before.
    """
    speed, turned = first_order(rows, drives, poles, start)
    if rows.turn:
        return turned / rows.duration[:, None]
    if not rows.window_s.any():
        return speed
    angle = np.cumsum(turned, axis=0) - turned
    first = np.arange(len(speed)) - rows.back
    part, poles = rows.part[:, None], _once(poles)
    inside = drives[first] * part + (speed[first] - drives[first]) * (1 - np.exp(-part * poles)) / poles
    return (angle - angle[first] - inside) / rows.window_s[:, None]


def flexible_model(rows: LogRows) -> Flexible:
    """The set of columns that predicts blocks left out best."""
    pole, delay = pole_and_delay(rows)
    sets = _sets(rows, pole, delay)
    starts = responses(rows, np.zeros((len(rows.volts), 1)), np.array([pole]), 1.0)[:, 0]
    most = rows.counts.sum() / ROWS_PER_COLUMN
    tried = [np.concatenate([sets[part] for part in parts], axis=1) for parts in CANDIDATES]
    fits = [_fitted(rows, columns, starts) for columns in tried if columns.shape[1] <= most]
    return min(fits or [_fitted(rows, tried[0], starts)], key=lambda fit: fit.level)


def _fitted(rows: LogRows, columns: np.ndarray, starts: np.ndarray) -> Flexible:
    """Least squares of the speed on `columns`."""
    valid, counts = rows.valid.astype(float), rows.counts
    both = np.concatenate([rows.speed[:, None], columns], axis=1) * valid[:, None]
    both = without_starts(rows, both, starts * valid)
    error, jacobian = both[:, 0], both[:, 1:]
    size = np.linalg.norm(jacobian, axis=0)
    jacobian = jacobian[:, size > 1e-9 * size.max()] / size[size > 1e-9 * size.max()]
    least = 1e-9 * np.eye(jacobian.shape[1])
    normal = jacobian.T @ jacobian + least
    error = error - jacobian @ np.linalg.solve(normal, jacobian.T @ error)
    left_out = error.copy()
    block = np.minimum(np.cumsum(counts) * BLOCKS // max(int(counts.sum()), 1), BLOCKS - 1)
    for number in range(BLOCKS):
        own = block == number
        part = jacobian[own]
        left_out[own] += part @ np.linalg.solve(normal - part.T @ part + least, part.T @ error[own])
    number = max(int(counts.sum()), 1)
    inside, outside = (error[counts] ** 2).sum() / number, (left_out[counts] ** 2).sum() / number
    return Flexible(float(np.sqrt((inside + min(outside, WORST * inside)) / 2)), error)


def without_starts(rows: LogRows, columns: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """`columns` with each piece's unknown initial speed at its best."""
    if not rows.free.any():
        return columns
    piece = rows.piece
    begin = np.flatnonzero(rows.reset)
    size = np.add.reduceat(starts**2, begin)
    speed = np.add.reduceat(starts[:, None] * columns, begin, axis=0) / np.where(size > 0, size, 1.0)[:, None]
    return columns - starts[:, None] * speed[piece]


def late(rows: LogRows, late_s: float) -> np.ndarray:
    """The mean of the voltage over each row, from so much earlier [V]; before a piece there was none, where the motor
    was at rest, else its first one."""
    first = np.flatnonzero(rows.reset)[rows.piece]
    time, integral = (np.append(0.0, np.cumsum(one)) for one in (rows.duration, rows.volts * rows.duration))

    def until(moment: np.ndarray) -> np.ndarray:
        before = np.minimum(moment - time[first], 0.0)
        return np.interp(moment - before, time, integral) + (rows.volts * rows.free)[first] * before

    return (until(time[1:] - late_s) - until(time[:-1] - late_s)) / rows.duration


def direction_of(rows: LogRows) -> np.ndarray:
    """Mean direction in which the shaft turns from each row to the next one, 0 where it may as well stand still.

    Between readings of opposite sign the speed is taken to be linear. A turn's own row would tell its error: the one
    before is taken.
    """
    band = 3 * _scatter(rows)
    now = np.where(rows.valid & (np.abs(rows.speed) > band), rows.speed, 0.0)
    if rows.turn:
        begin = np.flatnonzero(rows.reset)[rows.piece]
        return np.sign(now)[np.maximum(np.arange(len(now)) - 1, begin)]
    ends = np.append(rows.reset[1:], True)
    then = np.where(ends, now, np.append(now[1:], 0.0))
    size = np.abs(now) + np.abs(then)
    crossing = (np.abs(then) - np.abs(now)) / np.where(size > 0, size, 1.0) * np.sign(then)
    return np.where(now * then < 0, crossing, np.sign(now))


def _scatter(rows: LogRows) -> float:
    """Standard deviation of what is new in each reading [rad/s], from sixth differences: a motion that is slow beside
    the sampling hardly contributes to them."""
    sixth = np.abs(np.diff(rows.speed, 6))[rows.counts[6:]]
    # 924 is the sum of the squared binomials of a sixth difference, 1.4826 turns a median into a standard deviation.
    return 1.4826 * float(np.median(sixth)) / np.sqrt(924) if sixth.size else 0.0


def pole_and_delay(rows: LogRows) -> tuple[float, float]:
    """Pole [rad/s] and delay [s] with which voltage, offset and friction explain most."""
    shortest, total = float(rows.duration[rows.valid].min()), float(rows.duration[rows.valid].sum())
    poles = np.geomspace(1.0 / total, 3.0 / shortest, POLES)
    longest = min(max(DELAYS[8], LONGEST_DELAY_S / rows.typical_s), len(rows.volts) / 10)
    delays = np.array([0, *(delay for delay in DELAYS[1:] if delay <= longest)]) * rows.typical_s
    for points in (POLES // 2, POLES // 2, 0):
        cost = _costs(rows, poles, delays)
        at, number = np.unravel_index(np.argmin(cost), cost.shape)
        if points:
            poles = np.geomspace(poles[max(at - 1, 0)], poles[min(at + 1, len(poles) - 1)], points)
            delays = np.linspace(delays[max(number - 1, 0)], delays[min(number + 1, len(delays) - 1)], BETWEEN)
    return float(poles[at]), float(delays[number])


def _costs(rows: LogRows, poles: np.ndarray, delays: np.ndarray) -> np.ndarray:
    """(pole, delay) sum of squares that voltage, offset and friction leave."""
    every = [*(late(rows, delay) for delay in delays), direction_of(rows), np.ones_like(rows.volts)]
    drives, none = np.stack(every, axis=1), np.zeros((len(rows.volts), 1))
    valid = rows.valid[:, None]
    cost = np.empty((len(poles), len(delays)))
    chosen = np.stack(np.broadcast_arrays(1 + np.arange(len(delays)), len(delays) + 1, len(delays) + 2), axis=1)
    for number, pole in enumerate(poles):
        # One pole after the other: its columns stay in the processor's cache.
        columns = responses(rows, drives, np.full(drives.shape[1], pole))
        begins = responses(rows, none, np.array([pole]), 1.0)[:, 0]
        both = np.concatenate([rows.speed[:, None], columns], axis=1) * valid
        both = without_starts(rows, both, begins * rows.valid)
        cost[number] = _least(both.T @ both, chosen)
    return cost


def _least(gram: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(n,) sums of squares that the `chosen` columns (n, c) leave of column 0, from the Gram matrix of all."""
    right = gram[chosen, 0]
    of_column = solve_balanced(gram[chosen[:, :, None], chosen[:, None, :]], right, 1e-10)
    return gram[0, 0] - np.einsum("nc,nc->n", right, of_column)


CANDIDATES = ((0,), (0, 1), (0, 2), (0, 1, 3), (0, 1, 2, 3), (0, 1, 3, 4), (0, 1, 2, 3, 4))
"""Which of `_sets` are tried together."""


def _sets(rows: LogRows, pole: float, delay_s: float) -> list[np.ndarray]:
    """Columns of a linear motor; of friction; of linear motors with more lags; of more friction; of other laws."""
    volts, direction = late(rows, delay_s), direction_of(rows)
    size = float(np.abs(volts).max()) or 1.0
    linear = responses(rows, np.stack([volts, np.ones_like(volts)], axis=1), np.full(2, pole))
    friction = [direction, volts * (rows.valid & (direction == 0))]
    # Of whole rows: a delay between two of them is, for a lag, a sum of both.
    around = sorted({max(int(delay_s / rows.typical_s) + step, 0) for step in (-2, -1, 0, 1, 2)})
    delayed = [late(rows, number * rows.typical_s) for number in around]
    lags = _each(rows, delayed, pole * np.array([0.25, 0.5, 1, 2, 4]))
    speed = linear @ np.linalg.lstsq(linear[rows.valid], rows.speed[rows.valid], rcond=None)[0]
    speed = speed / (float(np.abs(speed).max()) or 1.0)
    time = np.cumsum(rows.duration) / rows.duration.sum()
    levels = np.quantile(np.abs(volts), [0.25, 0.5, 0.75])
    laws = [np.maximum(sign * volts - level, 0.0) for level in levels for sign in (1, -1)]
    laws += [np.abs(volts), speed * np.abs(speed) * size, speed * np.abs(volts), time * volts, time, time * direction]
    return [
        linear,
        _each(rows, friction, np.array([pole])),
        lags,
        _each(rows, friction, pole * np.array([0.33, 3.0])),
        _each(rows, laws, pole * np.array([0.5, 1.0, 2.0])),
    ]


def _each(rows: LogRows, drives: list[np.ndarray], poles: np.ndarray) -> np.ndarray:
    """The response to each of `drives` at each of `poles`."""
    wide = np.repeat(np.stack(drives, axis=1), len(poles), axis=1)
    return responses(rows, wide, np.tile(poles, len(drives)))
