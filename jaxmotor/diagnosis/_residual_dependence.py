"""Which coordinate the residual voltage depends on, and whether that is more than chance.

The residual voltage is regressed on a few columns of one coordinate (bins of speed, of voltage, of time; harmonics of
the shaft angle; a sine over time; rates of change). The share is the part of its variance that these explain (adjusted
R²). Chance is the share in the same voltages in random order: a dependence is beyond chance where it explains more than
all but `LEVEL` of the shuffles, divided by the number of coordinates tried.
"""

import dataclasses
from typing import Literal

import numpy as np

from jaxmotor.diagnosis._residual_voltage import ResidualVoltage

Coordinate = Literal["speed", "angle", "time", "voltage", "frequency"]
BINNED: tuple[tuple[Coordinate, str], ...] = (
    ("speed", "a torque that depends on the speed"),
    ("voltage", "a drive that is not in proportion to the voltage"),
    ("time", "something that changes in the course of the recording"),
)
"""Coordinates along which means are taken, and what a dependence on them looks like."""
BINS = 12
"""Of a coordinate, each with as many windows."""
AT_ONCE = 100
"""Frequencies whose phases are computed together, to double precision: those of all take half a gigabyte."""
HARMONICS = 8
"""Of a turn."""
SEEN = 0.03
"""Relative singular value, below which a wave over the angle is not seen: part of a turn shows few of them."""
SHUFFLES = 500
"""That tell a dependence from chance."""
LEVEL = 0.01
"""Share of the shuffles that may do better, divided by the number of coordinates."""
FASTEST_Hz = 8.0
"""Of waves over time that are looked for."""
SLOWEST_Hz = 0.2
"""The same."""


@dataclasses.dataclass(frozen=True, eq=False)
class Dependence:
    """One coordinate, and how much of the residual voltage depends on it."""

    coordinate: Coordinate
    text: str
    """What it looks like, for people."""
    share: float
    """Part of the variance explained [1]."""
    chance: float
    """Share that chance stays below, given the number of coordinates tried [1]."""
    at: np.ndarray
    """(k,) places of the curve, in the coordinate's unit (rad/s, rad, s, V, Hz)."""
    volts: np.ndarray
    """(k,) mean residual voltage there [V]."""

    moment_s: float | None = None
    """Of the change, where it is one at a moment [s]."""
    frequency_Hz: float | None = None
    """Where it is a sine over time [Hz]."""
    time_only: bool = False
    """It depends on time only: nothing that the motor does itself."""

    @property
    def beyond_chance(self) -> bool:
        return self.share > self.chance

    @classmethod
    def none(cls) -> "Dependence":
        """Where the recording is too short to say what anything depends on."""
        text = "more than noise; the recording is too short to say what it depends on"
        return cls("frequency", text, 0.0, 0.0, np.zeros(0), np.zeros(0))


def dependences(residual: ResidualVoltage, key: int = 0) -> tuple[Dependence, ...]:
    """All dependences that the recording can show, the largest share first. `key` seeds the shuffles.

    Needs forty windows at least; with fewer there are none.
    """
    if len(residual.volts) < 40 or np.ptp(residual.volts) == 0:
        return ()
    found = [_binned(coordinate, text, residual) for coordinate, text in BINNED]
    found += [maker(residual) for maker in (_step, _angle, _periodic, _rates)]
    views = [view for view in found if view is not None]
    centred = residual.volts - residual.volts.mean()
    shuffled = _shuffles(centred, key)
    every = [_assessed(view, centred, shuffled, len(views)) for view in views]
    return tuple(sorted(every, key=lambda one: -one.share))


@dataclasses.dataclass(frozen=True, eq=False)
class _View:
    coordinate: Coordinate
    text: str
    basis: np.ndarray
    """(windows, k) orthonormal columns without the mean; or (windows, m, 2) of which the best pair counts. Those are
    many, and in single precision."""
    at: np.ndarray
    volts: np.ndarray
    moment_s: float | None = None
    frequency_Hz: float | None = None


def _assessed(view: _View, centred: np.ndarray, shuffled: np.ndarray, number: int) -> Dependence:
    found = _share(view.basis, centred[:, None])[0]
    chance = np.quantile(_share(view.basis, shuffled), 1 - LEVEL / number)
    return Dependence(
        view.coordinate,
        view.text,
        float(found),
        float(max(chance, 0.0)),
        view.at,
        view.volts,
        view.moment_s,
        view.frequency_Hz,
        view.coordinate == "time",
    )


def _share(basis: np.ndarray, centred: np.ndarray) -> np.ndarray:
    """(c,) adjusted part that `basis` explains of each column of `centred` (n, c); all have one length."""
    whole = float(centred[:, 0] @ centred[:, 0])
    if basis.ndim == 3:
        explained, columns = _pairs(basis, centred).max(0), 2
    else:
        explained, columns = ((basis.T @ centred) ** 2).sum(0), basis.shape[1]
    free = len(centred) - 1
    return 1 - (1 - explained / whole) * free / (free - columns)


def _pairs(basis: np.ndarray, centred: np.ndarray) -> np.ndarray:
    """(m, c) what each pair of `basis` (n, m, 2) explains of each column of `centred` (n, c)."""
    flat = basis.reshape(len(basis), -1).T @ centred.astype(basis.dtype)
    return (flat**2).reshape(basis.shape[1], 2, -1).sum(1)


def _shuffles(centred: np.ndarray, key: int) -> np.ndarray:
    """(n, shuffles)"""
    rng = np.random.default_rng(key)
    return rng.permuted(np.repeat(centred[None], SHUFFLES, axis=0), axis=1).T


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    basis, weights, _ = np.linalg.svd(columns - columns.mean(0), full_matrices=False)
    return basis[:, weights > 1e-9 * max(weights[0], 1e-300)]


def _binned(coordinate: Coordinate, text: str, residual: ResidualVoltage) -> _View | None:
    value, volts = residual.along(coordinate), residual.volts
    edges = np.unique(np.quantile(value, np.linspace(0, 1, BINS + 1)[1:-1]))
    bins = np.searchsorted(edges, value)
    used = np.unique(bins)
    if len(used) < 3:
        return None
    members = (bins[:, None] == used[None, :]).astype(float)
    counts = members.sum(0)
    return _View(coordinate, text, _orthonormal(members), members.T @ value / counts, members.T @ volts / counts)


def _step(residual: ResidualVoltage) -> _View | None:
    """The best single change in time."""
    order = np.argsort(residual.time_s, kind="stable")
    volts, size = residual.volts[order], len(order)
    cuts = np.arange(size // 20 + 1, size - size // 20)
    total = np.cumsum(volts - volts.mean())
    cut = int(cuts[np.argmax(total[cuts - 1] ** 2 / (cuts * (size - cuts)))])
    when = float(residual.time_s[order[cut]])
    after = (residual.time_s >= when).astype(float)
    candidates = np.stack([(np.arange(size) >= c).astype(float) for c in cuts[:: max(1, len(cuts) // 60)]], axis=1)
    candidates = (candidates - candidates.mean(0)) / np.linalg.norm(candidates - candidates.mean(0), axis=0)
    basis = np.zeros((size, candidates.shape[1] + 1, 2), np.float32)
    basis[order, :-1, 0] = candidates
    basis[:, -1, 0] = (after - after.mean()) / np.linalg.norm(after - after.mean())
    before, behind = float(volts[:cut].mean()), float(volts[cut:].mean())
    return _View(
        "time", f"a change at t = {when:.1f} s, by {1e3 * (behind - before):+.0f} mV", basis,
        np.array([residual.time_s.min(), when]), np.array([before, behind]), moment_s=when,
    )  # fmt: skip


def _angle(residual: ResidualVoltage) -> _View | None:
    if np.isnan(residual.angle_rad).any() or np.ptp(residual.angle_rad) < 2 * np.pi:
        return None
    at, columns = np.linspace(0, 2 * np.pi, 73), _waves(residual.angle_rad)
    weights = np.linalg.lstsq(columns, residual.volts, rcond=SEEN)[0]
    size = np.hypot(weights[1::2], weights[2::2])
    best = int(np.argmax(size)) + 1
    text = f"something locked to the shaft's angle, {best} per turn, {1e3 * size[best - 1]:.0f} mV"
    return _View("angle", text, _orthonormal(columns[:, 1:]), at, _waves(at) @ weights)


def _waves(angle: np.ndarray) -> np.ndarray:
    """(n, 1 + 2 `HARMONICS`): one, and the sine and cosine of each harmonic."""
    waves = (wave(n * angle) for n in range(1, HARMONICS + 1) for wave in (np.sin, np.cos))
    return np.stack([np.ones_like(angle), *waves], axis=1)


def _periodic(residual: ResidualVoltage) -> _View | None:
    """A sine over time, at whatever frequency explains most."""
    duration = np.ptp(residual.time_s)
    if duration < 2 / SLOWEST_Hz:
        return None
    steps = int(min(2 * duration * (FASTEST_Hz - SLOWEST_Hz), 2500))
    frequency = np.linspace(SLOWEST_Hz, FASTEST_Hz, steps)
    basis = np.empty((len(residual.volts), steps, 2), np.float32)
    for begin in range(0, steps, AT_ONCE):
        own = slice(begin, begin + AT_ONCE)
        turns = residual.time_s[:, None] * frequency[own]
        angle = (2 * np.pi * (turns - np.floor(turns))).astype(np.float32)
        np.sin(angle, out=basis[:, own, 0])
        np.cos(angle, out=basis[:, own, 1])
    basis *= np.float32(np.sqrt(2 / len(residual.volts)))
    power = _pairs(basis, (residual.volts - residual.volts.mean())[:, None])[:, 0]
    best = float(frequency[np.argmax(power)])
    return _View(
        "time",
        f"something periodic at {best:.2f} Hz",
        basis,
        frequency,
        np.sqrt(2 * power / len(residual.volts)),
        frequency_Hz=best,
    )


def _rates(residual: ResidualVoltage) -> _View | None:
    """Delays, lags and inertia: volts that go with the rate at which voltage and speed change."""
    same = np.diff(residual.segment, prepend=-1) == 0
    columns = []
    for value in (residual.input_V, residual.speed_rad_s):
        change = np.where(same, np.diff(value, prepend=value[0]), 0.0)
        later = np.where(np.roll(same, -1), np.roll(change, -1), 0.0)
        columns += [change, later]
    text = "dynamics: a delay, a lag or a mass, seen where voltage and speed change"
    basis = _orthonormal(np.stack(columns, axis=1))
    weights = basis.T @ (residual.volts - residual.volts.mean())
    return _View("frequency", text, basis, np.arange(len(weights), dtype=float), weights)
