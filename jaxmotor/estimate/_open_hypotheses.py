"""What the input leaves open: laws that gain, pole and offset can imitate, and the motors there would be with them.

Beside the motor, and the laws that the recording shows (`_hidden`), each other one is let in alone, to first order. Its
amount is known to a standard error; where the motor can do nearly all that the law does, that error is huge, and only
what a motor can have bounds the amount.
Friction and a dead zone take their volts off the voltage: with a shift h = d log K/dv the gain is K/(1 - h v), which is
exact for steps of one height 1/h. The others move log K and log a in proportion.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from jaxmotor.estimate._hidden import Beside, Hidden
from jaxmotor.prediction import Packed

LIKELY = 2.0
"""Standard errors by which an amount may be off."""
MATTERS = 5.0
"""Standard errors of gain or pole by which the largest amount left open must move them to be worth a word."""
LEAST_SHARE = 0.01
"""Part of gain or pole by which it must move them for that, too."""
LARGEST = 20.0
"""Logarithm of the ratio of an interval's end to its middle at most."""
FARTHEST = 3.0
"""By which a logarithm of gain or pole is moved at most: to first order nothing is known so far away."""
ANYTHING = math.exp(FARTHEST)
"""Ratio of an interval's ends from which it says nothing."""
MOST_OF_VOLTAGE = 0.6
"""Part of the voltage that friction, a dead zone or drag takes at most of a motor that turns."""
MOST_TICKS = 2.0
"""Delay of a motor at most [rows]."""
MOST_LAG_S = 4e-3
"""Electrical time constant of a small motor at most."""
SHOWN = "what a linear motor leaves looks most like "
DECIDE = {
    "friction": "add steps of a second height",
    "dead zone": "add steps of a second height",
    "drag": "add steps of other heights",
    "delay": "add fast changes of the voltage",
    "electrical lag": "measure L/R, or record shorter rows",
}
BESIDE_SEVERAL = {
    "friction": "add steps to small voltages, at which the motor hardly turns",
    "dead zone": "add steps to small voltages, at which the motor hardly turns",
    "drag": "stay longer at small voltages, and at the largest",
}
"""Where voltages have several heights already."""
ALIKE, MOSTLY = 0.05, 0.8
"""Part of the largest voltage within which heights are one; and of the driven rows, that have the same one where
voltages have no other."""
PHRASES = {
    "friction": "Coulomb friction",
    "dead zone": "a dead zone",
    "drag": "drag that grows with the square of the speed",
    "delay": "a delay",
    "electrical lag": "an electrical time constant L/R",
}
UNITS = {"friction": "V", "dead zone": "V", "drag": "V at the highest speed", "delay": "rows", "electrical lag": "s"}


class OpenHypothesis(NamedTuple):
    """A law that the recording can neither show nor exclude."""

    name: str
    largest: float
    """The amount up to which it may be there [`UNITS`]."""
    gain: float
    """Of the motor if it is there with that [rad/s/V]."""
    pole: float
    """The same [rad/s]."""
    anything: bool = False
    """These are as far as first order goes, and not known beyond that."""
    several: bool = False
    """The input has several heights."""

    @property
    def decide(self) -> str:
        """The experiment that shows it, for people."""
        return (self.several and BESIDE_SEVERAL.get(self.name)) or DECIDE[self.name]

    @property
    def phrase(self) -> str:
        """The law, for people."""
        return PHRASES[self.name]

    @property
    def note(self) -> str:
        """What is open, what it would move, and the experiment that decides."""
        moved = f"the gain would be {self.gain:.4g} rad/s/V and the pole {self.pole:.4g} rad/s"
        if self.anything:
            moved = "gain and pole are not determined"
        return (
            f"this input does not show whether there is {self.phrase}: with as much as {self.largest:.2g} "
            f"{UNITS[self.name]} of it {moved}; to decide, {self.decide}"
        )


class Allowed(NamedTuple):
    """95 % intervals that span the motors with each of the laws that the recording does not exclude."""

    gain: tuple[float, float]
    """Lowest and highest [rad/s/V]."""
    pole: tuple[float, float]
    """The same [rad/s]."""

    def spanning(self, motor: np.ndarray, half: np.ndarray) -> "Allowed":
        """The intervals, wide enough for gain and pole of `motor` (2,) with `half` (2,) to each side."""
        ends = zip(self, *(side.tolist() for side in _sides(motor, half)), strict=True)
        return Allowed(*((min(own[0], low), max(own[1], high)) for own, low, high in ends))


def open_hypotheses(
    packed: Packed, motor: np.ndarray, half: np.ndarray, beside: Beside
) -> tuple[tuple[OpenHypothesis, ...], Allowed]:
    """Which of the laws `beside` a motor are open, and the intervals that allow for all of them.

    `motor` (2,) is gain [rad/s/V] and pole [rad/s], `half` (2,) the half widths of their 95 % intervals if nothing else
    is there.
    """
    found, shown, several = [], _with_shown(packed, motor, beside), has_several_heights(packed)
    corners = [*_sides(motor, half), *_sides(shown, half)]
    for name, amount, error, shift, _ in beside.shown:
        for moved in (LIKELY * error, -min(LIKELY * error, amount)):
            corners += _sides(_with(shown, shift, moved, name), half)
    scores = np.maximum(MATTERS / 1.96 * half, LEAST_SHARE * np.abs(motor))
    for name, amount, error, shift, _ in beside.others:
        largest = float(min(amount + LIKELY * error, _largest(packed, name)))
        if largest <= 0:
            continue
        with_it = _with(shown, shift, largest, name)
        corners += _sides(with_it, half)
        if (np.abs(with_it - shown) > scores).any():
            anything = bool(np.abs(np.log(with_it / shown)).max() > FARTHEST - 1e-9)
            gain, pole = map(float, with_it)
            found.append(OpenHypothesis(name, largest, gain, pole, anything, several))
    lowest, highest = np.min(corners, axis=0), np.max(corners, axis=0)
    ends = [(float(low), float(high)) for low, high in zip(lowest, highest, strict=True)]
    return tuple(found), Allowed(*ends)


def _with_shown(packed: Packed, motor: np.ndarray, beside: Beside) -> np.ndarray:
    """Gain and pole (2,) of `motor` with the laws that the recording shows `beside` it."""
    for law in beside.shown:
        motor = _with(motor, law.alone, _bounded(packed, law), law.name)
    return motor


def _bounded(packed: Packed, law: Hidden) -> float:
    """Its amount, of volts no more than a motor that turns can lose."""
    return min(law.amount, largest_voltage(packed)) if UNITS[law.name].startswith("V") else law.amount


def shown_laws(packed: Packed, motor: np.ndarray, beside: Beside) -> list[str]:
    """A sentence on the laws that the recording shows, if any."""
    if not beside.shown:
        return []
    if any(_bounded(packed, law) < law.amount for law in beside.shown):
        names = " and ".join(PHRASES[law.name] for law in beside.shown)
        return [f"{SHOWN}{names}, but by more than a motor can have; `jaxmotor diagnose` finds what it is"]
    laws = [f"{PHRASES[law.name]} ({law.amount:.2g} {UNITS[law.name]})" for law in beside.shown]
    gain, pole = _with_shown(packed, motor, beside)
    return [
        f"{SHOWN}{' and '.join(laws)}: with that the gain would be about "
        f"{gain:.4g} rad/s/V and the pole {pole:.4g} rad/s; `jaxmotor diagnose` finds what it is"
    ]


def _sides(motor: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends (2,) of the 95 % intervals of gain and pole of half widths `half` (2,), which are symmetric in their
    logarithms: a pole known to ± 100 % may be three times as large, but not negative."""
    ratio = np.exp(np.minimum(half / np.abs(motor), LARGEST))
    ends = motor / ratio, motor * ratio
    return np.minimum(*ends), np.maximum(*ends)


def _with(motor: np.ndarray, shift: np.ndarray, amount: float, name: str) -> np.ndarray:
    """Gain and pole with `amount` of the law; (2,) `shift` are those of their logarithms for one unit."""
    moved = np.exp(np.clip(shift * amount, -FARTHEST, FARTHEST))
    if name in ("friction", "dead zone") and 0 < shift[0] * amount < 1:
        moved[0] = 1 / (1 - shift[0] * amount)
    return motor * moved


def _largest(packed: Packed, name: str) -> float:
    """The largest amount that a motor which turns under these voltages can have."""
    if name in ("delay", "electrical lag"):
        return MOST_TICKS if name == "delay" else MOST_LAG_S
    return largest_voltage(packed)


def has_several_heights(packed: Packed) -> bool:
    """The motor is not driven by voltages that nearly all have one size."""
    sizes = np.abs(packed.batch.volts[packed.batch.valid])
    driven = sizes[sizes > ALIKE * sizes.max(initial=0.0)]
    if not len(driven):
        return False
    counts = np.unique(np.round(driven / (ALIKE * driven.max())), return_counts=True)[1]
    return bool(counts.max() < MOSTLY * len(driven))


def largest_voltage(packed: Packed) -> float:
    """That friction, a dead zone or drag takes at most of a motor which turns under these voltages [V]."""
    volts, observed = np.abs(packed.batch.volts), np.abs(packed.batch.observed)
    turning = packed.batch.valid & (observed > 0.1 * observed[packed.batch.valid].max(initial=0.0)) & (volts > 0)
    return MOST_OF_VOLTAGE * float(np.median(volts[turning])) if turning.any() else 0.0


def open_to_json(found: tuple[OpenHypothesis, ...], allowed: Allowed | None) -> dict[str, Any]:
    """The fields of a model file."""
    listed = [
        {
            "name": one.name,
            "largest": one.largest,
            "unit": UNITS[one.name],
            "gain_rad_s_V": one.gain,
            "pole_rad_s": one.pole,
            "decide": one.decide,
        }
        for one in found
    ]
    intervals = None if allowed is None else {"gain_rad_s_V": list(allowed.gain), "pole_rad_s": list(allowed.pole)}
    return {"open_hypotheses": listed, "interval_with_open_hypotheses": intervals}


def allowing(fit: Any) -> str | None:
    """The intervals of a fit or diagnosis that allow for open hypotheses; None where nothing is open."""
    if not fit.open_hypotheses or fit.allowed is None:
        return None
    gain, pole = _between(fit.allowed.gain, "rad/s/V"), _between(fit.allowed.pole, "rad/s")
    return f"with what the input leaves open: gain {gain}, pole {pole}"


def _between(ends: tuple[float, float], unit: str) -> str:
    """An interval, for people."""
    low, high = sorted(map(abs, ends))
    return "not determined" if high > ANYTHING * low > 0 else f"{ends[0]:.4g} to {ends[1]:.4g} {unit}"
