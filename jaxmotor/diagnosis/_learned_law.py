"""What was learned over a coordinate, and which known laws it is like."""

import dataclasses
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from jaxmotor.diagnosis._spline import steps

LearnedCoordinate = Literal["speed", "voltage", "angle", "time"]
HARMONICS = 8
FASTEST = 8.0
"""Cycles of a sine over the whole recording that a curve over time can show."""
SIZES = 24
"""Of a known shape that has one, over the coordinate's range."""
ALIKE = 0.9
"""Similarity from which a curve is said to be like a known one."""
Shape = tuple[str, str, np.ndarray, Literal["signed", "either", "level"]]


class Resemblance(NamedTuple):
    """A known law over the same coordinate, and how much a learned one is like it."""

    name: str
    """Of the effect; what it is where there is no such effect."""
    similarity: float
    """Correlation over the range, 0 to 1, without what a gain and an offset would absorb."""
    text: str


@dataclasses.dataclass(frozen=True, eq=False)
class LearnedLaw:
    """A voltage that the motor lacks, as a function of one coordinate."""

    coordinate: LearnedCoordinate
    at: np.ndarray
    """(n,) places [rad/s, V, rad within a turn, s since the recording began]."""
    volts: np.ndarray
    """(n,) that the motor lacks there [V]."""
    standard_error: np.ndarray
    """(n,) pointwise [V]."""
    share: float
    """Part of the excess chi2 of held-out data that it explains, of what a constant voltage leaves [1]."""
    gain: float
    """By how much it lowers the drift chi2 per sample of held-out data, beyond what a constant voltage does."""
    jump: float | None
    """Where the curve jumps, if it does."""
    resembles: tuple[Resemblance, ...]
    """Known shapes, the most alike first; none where nothing is explained."""

    @property
    def resemblance(self) -> str:
        """Which known law it is like, for people; empty where nothing is explained."""
        if not self.resembles:
            return ""
        return self.resembles[0].text if self.resembles[0].similarity > ALIKE else "like no known law"

    @property
    def text(self) -> str:
        """For people."""
        if not self.resembles:
            return f"nothing that depends on the {self.coordinate}"
        return f"a voltage that depends on the {self.coordinate}, {self.resemblance}"


def resemblances(
    coordinate: LearnedCoordinate, at: np.ndarray, volts: np.ndarray, weight: np.ndarray, jump: float | None
) -> tuple[Resemblance, ...]:
    """Known shapes that are like `volts`, the most alike first; each once, in the size that fits best."""
    best: dict[str, Resemblance] = {}
    for name, text, columns, kind in _shapes(coordinate, at, jump):
        similarity = _similarity(coordinate, at, volts, weight, columns, kind)
        if name not in best or similarity > best[name].similarity:
            best[name] = Resemblance(name, similarity, text)
    return tuple(sorted(best.values(), key=lambda one: -one.similarity))


def _shapes(coordinate: LearnedCoordinate, at: np.ndarray, jump: float | None) -> Iterator[Shape]:
    """Name, text, columns (n, k) and what about it is free."""
    if coordinate == "speed":
        return _over_speed(at)
    if coordinate == "voltage":
        return _over_voltage(at)
    return _over_angle(at) if coordinate == "angle" else _over_time(at, jump)


def _over_speed(at: np.ndarray) -> Iterator[Shape]:
    yield "coulomb_friction", "like Coulomb friction", -np.sign(at)[:, None], "signed"
    yield "quadratic_drag", "like a drag with the speed squared", (-at * np.abs(at))[:, None], "signed"
    yield "voltage_offset", "like a constant offset", np.ones((len(at), 1)), "level"


def _over_voltage(at: np.ndarray) -> Iterator[Shape]:
    size = np.abs(at)
    for volts in size.max() * np.arange(1, SIZES) / SIZES:
        place = f"{volts:.2g} V"
        yield "dead_zone", f"like a dead zone of {place}", -np.clip(at, -volts, volts)[:, None], "signed"
        yield "input_threshold", f"like a threshold at {place}", -np.where(size < volts, at, 0.0)[:, None], "signed"
        clipped = np.clip(at, -volts, volts) - at
        yield "voltage_saturation", f"like a saturation at {place}", clipped[:, None], "signed"
    yield "direction_asymmetry", "like a drive that is stronger one way", size[:, None], "either"
    yield "voltage_offset", "like a constant offset", np.ones((len(at), 1)), "level"


def _over_angle(at: np.ndarray) -> Iterator[Shape]:
    for n in range(1, HARMONICS + 1):
        yield "cogging", f"like a sine of {n} per turn", np.column_stack([np.sin(n * at), np.cos(n * at)]), "either"
    yield "voltage_offset", "like a constant offset", np.ones((len(at), 1)), "level"


def _over_time(at: np.ndarray, jump: float | None) -> Iterator[Shape]:
    if jump is not None:
        yield "step", f"like a step at {jump:.1f} s", steps(at, np.array([jump])), "either"
    yield "drift", "like a steady drift", at[:, None], "either"
    duration = float(np.ptp(at))
    for cycles in np.arange(1.0, FASTEST, 0.25) if duration > 0 else ():
        angle = 2 * np.pi * cycles / duration * at
        text = f"like a sine of {cycles / duration:.2g} Hz"
        yield "sine", text, np.column_stack([np.sin(angle), np.cos(angle)]), "either"
    yield "voltage_offset", "like a constant offset", np.ones((len(at), 1)), "level"


def _similarity(
    coordinate: LearnedCoordinate, at: np.ndarray, volts: np.ndarray, weight: np.ndarray, columns: np.ndarray, kind: str
) -> float:
    root = np.sqrt(weight)
    absorbed = [np.ones_like(at)]
    if coordinate in ("speed", "voltage"):
        absorbed.append(at)
    columns, curve = columns * root[:, None], volts * root
    if kind != "level":
        taken = np.linalg.qr(np.column_stack(absorbed) * root[:, None])[0]
        columns, curve = columns - taken @ (taken.T @ columns), curve - taken @ (taken.T @ curve)
    size = np.linalg.lstsq(columns, curve)[0]
    if kind == "signed" and size[0] <= 0:
        return 0.0
    length = float(np.linalg.norm(curve))
    return float(np.clip(np.linalg.norm(columns @ size) / length, 0.0, 1.0)) if length > 0 else 0.0
