"""What was learned over a coordinate, and which known laws it is like."""

import dataclasses
import math
import sys
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from jaxmotor._numbers import with_error
from jaxmotor.motor.effects import AbstractLearnedEffect, LearnedCoordinate, LearnedUnit

HARMONICS = 12
"""Of a turn that a curve over the angle may be like."""
FASTEST = 8.0
"""Cycles of a sine over the whole recording that a curve over time can show."""
SIZES, SECTORS = 120, 24
"""Of a known shape that has one, over the coordinate's range; and places where a sector may begin."""
ROUNDING = 1e-9
"""Part of a shape that is its rounding, where gain and offset absorb the rest."""
ALIKE = 0.9
"""Similarity from which a curve is said to be like a known one."""


class Resemblance(NamedTuple):
    """A known law over the same coordinate, and how much a learned one is like it."""

    name: str
    """Of the effect; what it is where there is no such effect."""
    similarity: float
    """Correlation over the range, 0 to 1, without what a gain and an offset would absorb."""
    text: str
    most: float = 0.0
    """The most that the known law adds over the range, in the size that is nearest [V or rad]."""
    standard_error: float = 0.0
    """[V or rad]"""

    def sized(self, unit: LearnedUnit) -> str:
        """`text` and the size, which is in `unit`, for people."""
        return f"{self.text}, {_up_to(self.most, self.standard_error, unit)}"


def _up_to(size: float, standard_error: float, unit: LearnedUnit) -> str:
    """The most that a curve adds [`unit`], for people."""
    if not 1.96 * standard_error < size:
        return "of a size that is not determined"
    return f"of up to {with_error(1e3 * size, 1e3 * standard_error, f'm{unit}')}"


class Shape(NamedTuple):
    """A known law over a coordinate."""

    name: str
    text: str
    columns: np.ndarray
    """(n, 1 or 2) [1]"""
    kind: Literal["signed", "either"]
    """Of one sign only, or of either."""


@dataclasses.dataclass(frozen=True, eq=False)
class LearnedLaw:
    """Residual voltage, or an error of the reading, as a function of one coordinate."""

    coordinate: LearnedCoordinate
    at: np.ndarray
    """(n,) places [rad/s, V, rad within a turn, s since the recording began]."""
    values: np.ndarray
    """(n,) residual voltage, or what is added to the angle that is read, there [`unit`]."""
    standard_error: np.ndarray
    """(n,) pointwise [`unit`]."""
    share: float
    """Part of the excess chi2 of held-out data that it takes from the motor without it [1]."""
    gain: float
    """By how much it lowers the drift chi2 per sample of held-out data."""
    resembles: tuple[Resemblance, ...]
    """Known shapes, the most alike first; none where nothing is explained."""
    unit: LearnedUnit = "V"
    """Of `values`."""

    @property
    def what(self) -> str:
        """It is, for people."""
        return "a voltage" if self.unit == "V" else "an error of the reading"

    @property
    def resemblance(self) -> str:
        """Which known law it is like, for people; empty where nothing is explained."""
        if not self.resembles:
            return ""
        like = self.resembles[0]
        return like.sized(self.unit) if like.similarity > ALIKE else f"like no known law{self._size}"

    @property
    def _size(self) -> str:
        most = int(np.argmax(np.abs(self.values)))
        return f", {_up_to(abs(float(self.values[most])), float(self.standard_error[most]), self.unit)}"

    @property
    def text(self) -> str:
        """For people."""
        if not self.resembles:
            return f"nothing that depends on the {self.coordinate}"
        return f"{self.what} that depends on the {self.coordinate}, {self.resemblance}"


def resemblances(
    law: type[AbstractLearnedEffect],
    at: np.ndarray,
    values: np.ndarray,
    weight: np.ndarray,
    covariance: np.ndarray,
    most: float = math.inf,
) -> tuple[Resemblance, ...]:
    """Known shapes that are like `values` (n,) of a learned `law` with this `covariance`, the most alike first; each
    once, in the size that fits best. None that adds more than `most`: what is nearly straight is like the little that
    many shapes bend."""
    best: dict[str, Resemblance] = {}
    for shape in _shapes(law, at):
        found = _resemblance(law.coordinate, at, values, weight, covariance, shape)
        # Of equals the last: a threshold is at the first voltage that acts.
        if found.most <= most and (shape.name not in best or found.similarity >= best[shape.name].similarity):
            best[shape.name] = found
    return tuple(sorted(best.values(), key=lambda one: -one.similarity))


def _shapes(law: type[AbstractLearnedEffect], at: np.ndarray) -> Iterator[Shape]:
    match law.coordinate:
        case "speed":
            return _over_speed(at)
        case "voltage":
            return _over_voltage(at)
        case "angle":
            return _over_angle(at) if law.unit == "V" else _waves(at, "encoder_eccentricity")
        case "time":
            return _over_time(at)


def _over_speed(at: np.ndarray) -> Iterator[Shape]:
    sign, size = np.sign(at), np.abs(at)
    yield Shape("coulomb_friction", "like Coulomb friction", -sign[:, None], "signed")
    yield Shape("quadratic_drag", "like a drag with the square of the speed", (-at * size)[:, None], "signed")
    yield Shape("cubic_drag", "like a drag with the cube of the speed", -(at**3)[:, None], "signed")
    for speed in size.max() * np.arange(1, SIZES) / SIZES:
        near = -sign * np.exp(-np.square(at / speed))
        yield Shape("stribeck", f"like a friction that falls within {speed:.2g} rad/s", near[:, None], "signed")
        full = -sign * -np.expm1(-size / speed)
        yield Shape("exponential", f"like a drag that is full from {speed:.2g} rad/s on", full[:, None], "signed")


def _over_voltage(at: np.ndarray) -> Iterator[Shape]:
    size = np.abs(at)
    for volts in size.max() * np.arange(1, SIZES) / SIZES:
        place = f"{volts:.2g} V"
        yield Shape("dead_zone", f"like a dead zone of {place}", -np.clip(at, -volts, volts)[:, None], "signed")
        below = -np.where(size < volts, at, 0.0)
        yield Shape("input_threshold", f"like a threshold at {place}", below[:, None], "signed")
        clipped = np.clip(at, -volts, volts) - at
        yield Shape("voltage_saturation", f"like a saturation at {place}", clipped[:, None], "signed")
    yield Shape("cubic_drive", "like the cube of the voltage", (at**3)[:, None], "either")
    yield Shape("direction_asymmetry", "like a drive that is stronger one way", size[:, None], "either")


def _waves(at: np.ndarray, name: str) -> Iterator[Shape]:
    for n in range(1, HARMONICS + 1):
        wave = np.column_stack([np.sin(n * at), np.cos(n * at)])
        yield Shape(name, f"like a sine of {n} per turn", wave, "either")


def _over_angle(at: np.ndarray) -> Iterator[Shape]:
    yield from _waves(at, "cogging")
    for begin in np.linspace(0, 2 * np.pi, SECTORS, endpoint=False):
        for width in np.pi * np.arange(1, 13) / 12:
            inside = np.mod(at - begin, 2 * np.pi) < width
            text = f"like a sector of {np.degrees(width):.0f} degrees"
            yield Shape("sector", text, inside.astype(float)[:, None], "either")


def _over_time(at: np.ndarray) -> Iterator[Shape]:
    yield Shape("drift", "like a steady drift", at[:, None], "either")
    duration = float(np.ptp(at))
    for cycles in np.arange(1.0, FASTEST, 0.25) if duration > 0 else ():
        angle = 2 * np.pi * cycles / duration * at
        text = f"like a sine of {cycles / duration:.2g} Hz"
        yield Shape("sine", text, np.column_stack([np.sin(angle), np.cos(angle)]), "either")


def _resemblance(
    coordinate: LearnedCoordinate,
    at: np.ndarray,
    values: np.ndarray,
    weight: np.ndarray,
    covariance: np.ndarray,
    shape: Shape,
) -> Resemblance:
    """In the size that is nearest by weighted least squares, beside what a gain and an offset would absorb."""
    root = np.sqrt(weight)
    absorbed = [np.ones_like(at)]
    if coordinate in ("speed", "voltage"):
        absorbed.append(at)
    # At speeds far above its own a shape is next to nothing everywhere: its most is 1 here, so that it can be squared.
    unit = shape.columns / max(float(np.abs(shape.columns).max()), sys.float_info.min)
    whole, curve = unit * root[:, None], values * root
    taken = np.linalg.qr(np.column_stack(absorbed) * root[:, None])[0]
    columns, curve = whole - taken @ (taken.T @ whole), curve - taken @ (taken.T @ curve)
    shows = np.linalg.norm(columns) > ROUNDING * np.linalg.norm(whole)
    into = np.linalg.pinv(columns)
    size, length = into @ curve, float(np.linalg.norm(curve))
    if length == 0 or not (shows and size.any()) or (shape.kind == "signed" and size[0] <= 0):
        return Resemblance(shape.name, 0.0, shape.text)
    similarity = float(np.clip(np.linalg.norm(columns @ size) / length, 0.0, 1.0))
    spread = (into * root) @ covariance @ (into * root).T
    most = float(np.linalg.norm(size))
    error = float(np.sqrt(max(size @ spread @ size, 0.0))) / most
    return Resemblance(shape.name, similarity, shape.text, most, error)
