"""A random experiment plan for a random rig: what `hidden` drives."""

import dataclasses
from typing import NamedTuple

import numpy as np

LONGEST_TICKS = 16_000
LEAST_PERIODS = 2
"""Periods that a sine lasts at least."""


@dataclasses.dataclass(frozen=True)
class Rig:
    """A linear motor at the output shaft, and what drives and measures it."""

    gain: float
    """[rad/s/V]"""
    pole: float
    """[rad/s]"""
    electrical_time_constant: float
    """[s]"""
    viscous_share: float
    """bR/(bR + Kt^2) [1]"""
    resistance_ohm: float
    supply_V: float
    counts_per_rev: float
    period_s: float
    full_scale: int
    start: int
    """Seed of the shaft's start, within a turn and within a count, and of torque that wanders."""

    @property
    def top_speed(self) -> float:
        """At full duty [rad/s]."""
        return self.gain * self.supply_V

    @property
    def counts_per_tick(self) -> float:
        """At 1 rad/s."""
        return self.counts_per_rev * self.period_s / (2 * np.pi)

    def duty(self, volts: np.ndarray) -> np.ndarray:
        return np.rint(volts / self.supply_V * self.full_scale).astype(np.int32)

    def ticks(self, seconds: float) -> int:
        return round(seconds / self.period_s)


class Loop(NamedTuple):
    """A run of the board's speed loop, in its integer units."""

    reference: np.ndarray
    kp: int
    ki: int


class Experiment(NamedTuple):
    """One segment: duties per tick, or a closed loop that finds them."""

    kind: str
    parameters: dict[str, float]
    drive: np.ndarray | Loop

    @property
    def ticks(self) -> int:
        return len(self.drive.reference if isinstance(self.drive, Loop) else self.drive)


def draw_rig(rng: np.random.Generator) -> Rig:
    """A geared motor of 30-90 rad/s at full supply; one in six is a faster one without a gearbox."""
    direct = rng.uniform() < 1 / 6
    supply = round(rng.uniform(6.0, 12.0), 2)
    top_speed = rng.uniform(150, 300) if direct else rng.uniform(30, 90)
    most_counts = 1000 if direct else 2250  # the board's loop takes 511 counts a tick
    return Rig(
        gain=top_speed / supply,
        pole=float(np.exp(rng.uniform(np.log(12), np.log(60)))),
        electrical_time_constant=rng.uniform(50e-6, 120e-6),
        viscous_share=rng.uniform(0.02, 0.07),
        resistance_ohm=rng.uniform(2.0, 8.0),
        supply_V=supply,
        counts_per_rev=round(float(np.exp(rng.uniform(np.log(360), np.log(most_counts)))), 1),
        period_s=float(rng.choice([0.004, 0.005, 0.006, 0.008, 0.010])),
        full_scale=int(rng.choice([250, 255])),
        start=int(rng.integers(1, 2**31)),
    )


def draw_plan(rig: Rig, rng: np.random.Generator) -> list[Experiment]:
    """60-80 s, at most `LONGEST_TICKS`: sines at two amplitudes, steps, slow ramps, a closed loop, perhaps levels."""
    seconds = min(rng.uniform(60, 80), LONGEST_TICKS * rig.period_s)
    others = [*_steps(rig, rng), *_ramps(rig, rng), _closed_loop(rig, rng)]
    if rng.uniform() < 0.4:
        others.append(_staircase(rig, rng))
    if rng.uniform() < 0.5:
        others.append(_prbs(rig, rng))
    left = seconds - sum(experiment.ticks for experiment in others) * rig.period_s
    plan = [*_sines(rig, rng, left), *others]
    places = np.arange(len(plan)) + rng.normal(scale=4, size=len(plan))
    return [plan[k] for k in np.argsort(places)]


def _sines(rig: Rig, rng: np.random.Generator, seconds: float) -> list[Experiment]:
    """In `seconds` together; no frequency is whole, so that the encoder does not repeat itself."""
    number = int(rng.integers(6, 10))
    detuned = 1 + rng.choice([-1, 1], number) * rng.uniform(0.001, 0.01, number)
    frequencies = np.round(np.geomspace(0.4, min(12.0, 0.08 / rig.period_s), number) * detuned, 4)
    amplitudes = np.round(rig.supply_V * np.array([rng.uniform(0.65, 0.9), rng.uniform(0.2, 0.35)]), 3)
    least = LEAST_PERIODS / frequencies
    lasting = _lasting(least, seconds / len(amplitudes))
    return [
        _sine(rig, float(frequency), float(amplitude), long)
        for amplitude in amplitudes
        for frequency, long in zip(frequencies, lasting, strict=True)
    ]


def _lasting(least: np.ndarray, together: float) -> np.ndarray:
    """The larger of `least` and one length for all that makes the sum `together` [s]."""
    low, high = 0.0, together
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if np.maximum(least, middle).sum() < together else (low, middle)
    return np.maximum(least, low)


def _sine(rig: Rig, frequency: float, amplitude: float, seconds: float) -> Experiment:
    time = np.arange(rig.ticks(seconds)) * rig.period_s
    duty = rig.duty(amplitude * np.sin(2 * np.pi * frequency * time))
    return Experiment("sine", {"frequency_Hz": frequency, "amplitude_V": amplitude}, duty)


def _steps(rig: Rig, rng: np.random.Generator) -> list[Experiment]:
    """Full duty, a middle and a low one, and perhaps a fourth; each both ways, not quite the same."""
    shares = [1.0, rng.uniform(0.5, 0.75), rng.uniform(0.2, 0.4), *([rng.uniform(0.8, 0.95)] * (rng.uniform() < 0.5))]
    ticks = rig.ticks(rng.uniform(0.7, 0.95))
    heights = [sign * share * (1 if share == 1.0 else rng.uniform(0.95, 1.05)) for share in shares for sign in (1, -1)]
    return [_level(rig, round(min(height, 1.0) * rig.supply_V, 3), ticks) for height in heights]


def _level(rig: Rig, volts: float, ticks: int) -> Experiment:
    return Experiment("step", {"amplitude_V": volts}, rig.duty(np.full(ticks, volts)))


def _ramps(rig: Rig, rng: np.random.Generator) -> list[Experiment]:
    """Up, down through zero, and back: one that stays low, one to the middle."""
    shares = rng.uniform(0.15, 0.3), rng.uniform(0.35, 0.6)
    return [_ramp(rig, round(share * rig.supply_V, 3), rng.uniform(4.5, 6.0)) for share in shares]


def _ramp(rig: Rig, volts: float, seconds: float) -> Experiment:
    turns = np.linspace(0, 1, rig.ticks(seconds))
    shape = np.interp(turns, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    return Experiment("ramp", {"amplitude_V": volts}, rig.duty(volts * shape))


def _staircase(rig: Rig, rng: np.random.Generator) -> Experiment:
    levels = rng.uniform(-0.9, 0.9, 10) * rig.supply_V
    return Experiment("other", {}, rig.duty(np.repeat(levels, rig.ticks(rng.uniform(0.3, 0.45)))))


def _prbs(rig: Rig, rng: np.random.Generator) -> Experiment:
    volts, hold = round(rng.uniform(0.4, 0.8) * rig.supply_V, 3), rig.ticks(rng.uniform(0.025, 0.06))
    signs = rng.choice([-1, 1], rig.ticks(rng.uniform(3, 4)) // hold)
    return Experiment("prbs", {"amplitude_V": volts, "hold_ticks": hold}, rig.duty(volts * np.repeat(signs, hold)))


def _closed_loop(rig: Rig, rng: np.random.Generator) -> Experiment:
    """P or PI on a square reference; gains as the board rounds them (docs/protocol.md)."""
    gain = min(rng.uniform(0.3, 0.6) / (1 - np.exp(-rig.pole * rig.period_s)), 4.0) / rig.gain
    integral_gain = gain * rng.uniform(2, 8) if rng.uniform() < 0.5 else 0.0
    duty_per_count = rig.full_scale / rig.supply_V / rig.counts_per_tick
    kp, ki = round(256 * gain * duty_per_count), round(65536 * integral_gain * rig.period_s * duty_per_count)
    reference = round(16 * rng.uniform(0.3, 0.6) * rig.top_speed * rig.counts_per_tick)
    half = rig.ticks(rng.uniform(0.6, 0.9))
    parameters = {
        "reference_rad_s": reference / 16 / rig.counts_per_tick,
        "half_period_s": round(half * rig.period_s, 6),
        "gain": kp / 256 / duty_per_count,
    }
    if ki:
        parameters["integral_gain"] = ki / 65536 / rig.period_s / duty_per_count
    square = np.repeat(reference * np.array([1, -1] * 3), half)
    return Experiment("closed_loop", parameters, Loop(square, kp, ki))
