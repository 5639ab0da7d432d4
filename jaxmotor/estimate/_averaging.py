"""Fit how the speeds of a log were averaged beside its motor, where the header does not state it.

Speeds may be instantaneous, means over a window before the row, or behind a first-order filter, and rows may be read
off the moments at which voltages change. Each is one more of ψ's elements (`prediction._linear`); the others are held.
Of all these the one with the least

    n' ln S + k ln n'

is taken, S the sum of squares, k the number of such elements, and n' the rows over those that one independent reading
takes (`Noise.rows_per_reading`). A window of up to a row and a reading that is early by half of it give the same
readings of a motor of first order; where both do as well, the answer says so.
"""

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate._assess import QUIET_CHI2, Assessment, assess, colour, explained
from jaxmotor.estimate._estimate import Estimate, fit_whole
from jaxmotor.estimate._hidden import student_t
from jaxmotor.estimate._speed_average import stated_window
from jaxmotor.estimate._uncertainty import HIDDEN
from jaxmotor.prediction import LAG_S, NONE_ROWS, Noise, Packed, as_problem, pack, without_transients
from jaxmotor.recording import Recording

STARTS = {"window": (1.5, 4.0, 10.0, 20.0, 50.0, 120.0), "filter": (1.5, 4.0, 10.0, 30.0)}
"""Lengths from which they are sought [rows], if they are no longer than the longest."""
OF_LOG = ("filter", "window", "offset")
"""Elements of ψ after the motor's pole."""
FIRST_OFFSET = -0.25
"""Timing offset from which it is sought [rows]."""
LONGEST_AVERAGE_ROWS, LONGEST_AVERAGE_S = 40.0, 0.2
"""Length of a window or a filter that is no average but the motor: longer than both."""
ALIKE = 6.0
"""Difference of the criterion up to which two candidates do as well."""
SAME = 1e-3
"""Part by which sums of squares differ where two starts came to the same end."""


class Candidate(NamedTuple):
    """One way in which the speeds may have been made, and the fit with it."""

    of_log: tuple[str, ...]
    """Which of `OF_LOG` were fitted."""
    estimate: Estimate

    @property
    def psi(self) -> np.ndarray:
        """(6,)"""
        return np.asarray(self.estimate.solution.psi)

    @property
    def square(self) -> float:
        """Sum of squares."""
        return float((np.asarray(self.estimate.solution.residual) ** 2).sum())


def averaged(
    recording: Recording,
    fitted: tuple[int, ...],
    noise: Noise,
    psi: np.ndarray,
    seed: int,
    also_held: tuple[int, ...] = (),
) -> tuple[Packed, Estimate, Assessment] | None:
    """The fit with the average of the speeds, sought from the motor `psi` (3,); None where none is seen.

    `noise` is that of a speed while nothing is known of the average. Of the motor `also_held` are not fitted. None also
    where more than noise is left: friction may have been taken for an average.
    """
    packed = packed_for_average(recording, fitted, noise)
    search = _Search(recording, packed, psi, seed, also_held)
    chosen = search.chosen()
    if chosen is not None and "window" in chosen.of_log:
        # The noise is known once the window is.
        length = stated_window(recording, float(np.exp(chosen.psi[4])) * packed.durations[0])
        restated = dataclasses.replace(recording, speed_window_s=length)
        search.packed = without_transients(recording, pack(restated, fitted, rest_before=True, few_shapes=True))
        chosen = search.fit(chosen.of_log, chosen.psi)
    quiet = chosen is not None and float(chosen.estimate.errors.chi2) < QUIET_CHI2
    if chosen is None or not (quiet or explained(search.packed, chosen.estimate.errors)):
        return None
    estimate = _only(chosen)
    assessment = assess(recording, search.packed, *estimate, chosen.of_log, search.alike, also_held)
    return search.packed, estimate, assessment


def offset_alone(recording: Recording, packed: Packed, psi: np.ndarray, seed: int) -> Estimate | None:
    """The fit from the motor `psi` (3,) with a timing offset of instantaneous speeds; None where it does not settle.

    By the program that `averaged` has compiled: the average of the speeds is held at none.
    """
    found = _Search(recording, packed, psi, seed, ()).offset()
    return None if found is None else _only(found)


def packed_for_average(recording: Recording, fitted: tuple[int, ...], noise: Noise) -> Packed:
    """The segments `fitted`, packed for a fit with the average of their speeds, in this `noise`."""
    return without_transients(recording, pack(recording, fitted, rest_before=True, few_shapes=True, noise=noise))


def longest_average_s(row_s: float) -> float:
    """Over which speeds are averaged at most, of rows that take `row_s` [s]."""
    return max(LONGEST_AVERAGE_ROWS * row_s, LONGEST_AVERAGE_S)


class _Search:
    """All candidates of one recording."""

    def __init__(
        self, recording: Recording, packed: Packed, psi: np.ndarray, seed: int, also_held: tuple[int, ...]
    ) -> None:
        self.recording, self.packed, self.seed, self.also_held = recording, packed, seed, also_held
        self.start = np.array([*psi[:3], np.log(LAG_S[0]), np.log(NONE_ROWS), 0.0])
        self.alike = False
        """Readings off the moments at which voltages change do as well as the window."""

    def fit(self, of_log: tuple[str, ...], start: np.ndarray) -> Candidate | None:
        """From ψ `start` (6,); None where it does not settle, or settles at what is no average."""
        held = np.array([place in self.also_held for place in range(3)] + [name not in of_log for name in OF_LOG])
        try:
            estimate = fit_whole(self.recording, as_problem(self.packed, True, held), start, self.seed)
        except JaxmotorError:
            return None
        found = Candidate(of_log, estimate)
        row_s = self.packed.durations[0]
        sizes = np.array([np.exp(found.psi[3]) / row_s, np.exp(found.psi[4]), abs(found.psi[5])])
        plausible = (LAG_S[0] / row_s, NONE_ROWS, 0.0) <= sizes
        longest = longest_average_s(row_s) / row_s
        plausible &= sizes < (longest, longest, 1.0)
        # A filter behind a motor does not ring.
        plausible[0] &= found.psi[2] + found.psi[3] < np.log(0.25)
        return found if (plausible | held[3:]).all() else None

    def chosen(self) -> Candidate | None:
        """The best; None where nothing, or an offset alone, does as well."""
        ways = {one.of_log: one for one in self._all() if one is not None}
        if not ways:
            return None
        best = min(ways.values(), key=self._cost)
        window, offset = ways.get(("window",)), ways.get(("offset",))
        if window is not None and offset is not None:
            self.alike = bool(abs(self._cost(window) - self._cost(offset)) < ALIKE)
            best = window if self.alike and best is offset else best
        return best if {"window", "filter"} & {*best.of_log} else None

    def _all(self) -> Iterator[Candidate | None]:
        yield self.fit((), self.start)
        timed = self.recording.duty_delay_s is None
        if timed:
            yield self.offset()
        for way in ("window", "filter"):
            own = self._best(way)
            yield own
            if timed and own is not None:
                yield self.fit((way, "offset"), self._shorter(own))

    def offset(self) -> Candidate | None:
        """Of instantaneous speeds."""
        return self.fit(("offset",), np.append(self.start[:-1], FIRST_OFFSET))

    def _best(self, way: str) -> Candidate | None:
        """Of all starts, of which the rest are left out once two came to the same end."""
        best, row_s = None, self.packed.durations[0]
        for rows in (rows for rows in STARTS[way] if rows * row_s < longest_average_s(row_s)):
            start = self.start.copy()
            start[3 + OF_LOG.index(way)] = np.log(rows * (row_s if way == "filter" else 1.0))
            one = self.fit((way,), start)
            if one is not None and best is not None and abs(one.square - best.square) < SAME * best.square:
                break
            best = min((each for each in (best, one) if each is not None), key=lambda each: each.square, default=None)
        return best

    def _shorter(self, one: Candidate) -> np.ndarray:
        """ψ with an offset and as much less of window or filter, so that speeds are as late as before."""
        start, at = one.psi.copy(), 3 + OF_LOG.index(one.of_log[0])
        less = -FIRST_OFFSET * (2 if at == 4 else self.packed.durations[0])
        start[[at, 5]] = np.log(max(np.exp(start[at]) - less, less)), FIRST_OFFSET
        return start

    def _cost(self, one: Candidate) -> float:
        number = len(self.packed) / colour(self.packed)
        return number * np.log(one.square) + len(one.of_log) * np.log(number)


def _only(candidate: Candidate) -> Estimate:
    """The estimate of the motor and of what was fitted of the log; a filter's time constant is its own."""
    psi, (solution, errors) = candidate.psi.copy(), candidate.estimate
    kept = [0, 1, 2, *(3 + OF_LOG.index(name) for name in candidate.of_log)]
    change = np.eye(len(psi))
    if "filter" in candidate.of_log:
        error = np.sqrt(np.asarray(errors.clustered)[2:4, 2:4].sum())
        half = student_t(float(np.min(errors.degrees_of_freedom))) * float(error)
        psi[2:4], change[2:4, 2:4] = _apart(psi[2], psi[3], half)
    change = change[kept]
    squares = ("model", "clustered", "requantised")
    both = {name: change @ np.asarray(getattr(errors, name)) @ change.T for name in squares}
    one = {name: change @ np.asarray(getattr(errors, name)) for name in ("allowance", "hidden_shift")}
    if "filter" in candidate.of_log:
        one["hidden_shift"][:, HIDDEN.index("electrical lag")] = 0.0  # L/R is in the filter's time constant
    freedom = np.asarray(errors.degrees_of_freedom)[kept]
    return Estimate(
        solution._replace(psi=psi[kept], jacobian=np.asarray(solution.jacobian)[..., kept]),
        errors._replace(**both, **one, degrees_of_freedom=freedom),
    )


def _apart(log_pole: float, log_lag: float, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """(log a, log 1/p) of the lags a < p of which one of second order is made, and their derivative.

    With D² = 1 - 4 a' τ' they are (1 - D)/(2 τ') and (1 + D)/(2 τ'). The slope of D, which has none at zero, is that
    over `spread`, the half interval of log a' + log τ'.
    """
    product = 4 * np.exp(log_pole + log_lag)
    ends = np.sqrt(np.maximum(1 - product * (1 + spread * np.array([-1.0, 0.0, 1.0])), 0.0))
    apart, moved = ends[1], np.abs(ends - ends[1]).max() / max(spread, 1e-300)
    logs = np.array([np.log1p(-apart), -np.log1p(apart)]) + np.array([-1.0, 1.0]) * (np.log(2) + log_lag)
    by_product = moved / np.array([1 - apart, 1 + apart])
    return logs, np.stack([by_product, by_product + np.array([-1.0, 1.0])], axis=1)
