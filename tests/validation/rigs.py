"""Rigs in plain numpy: a motor integrated in small Euler steps, an encoder, a bridge and a speed controller."""

import dataclasses
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.estimate import Model
from jaxmotor.motor import AbstractLinearMotor, FirstOrder, SecondOrder
from jaxmotor.recording import Recording, Segment

PERIOD = 0.005
COUNTS = 617.4
FULL = 255
SUPPLY = 7.4
FINE = 500
"""Substeps of 10 us."""


@dataclasses.dataclass
class Rig:
    """w' = a (K (u + u0) - w), or with a winding: w' = a m, τ m' = K (u + u0) - w - m."""

    gain: float = 11.0
    pole: float = 40.0
    tau: float = 0.0
    offset_V: float = 0.0
    substeps: int = 20
    encoder: float = 0.37
    """Offset of the encoder [count]."""
    counts: float = COUNTS
    speed: float = 0.0
    torque: float = 0.0

    def __post_init__(self):
        self.angle = 0.0

    def count(self) -> int:
        return int(np.floor(self.angle * self.counts / (2 * np.pi) + self.encoder))

    def hold(self, volts: float) -> None:
        """The midpoint rule, so that coarse steps will do as well."""
        h = PERIOD / self.substeps
        for _ in range(self.substeps):
            speed, torque = self.rates(volts, self.speed, self.torque)
            middle = self.speed + h / 2 * speed
            speed, torque = self.rates(volts, middle, self.torque + h / 2 * torque)
            self.angle += h * middle
            self.speed += h * speed
            self.torque += h * torque

    def rates(self, volts: float, speed: float, torque: float) -> tuple[float, float]:
        target = self.gain * (volts + self.offset_V)
        if not self.tau:
            return self.pole * (target - speed), 0.0
        return self.pole * torque, (target - speed - torque) / self.tau


def open_loop(rig: Rig, duty: np.ndarray, kind: str = "step", **header) -> Segment:
    """The rig under `duty`, whatever it did before."""
    counts = []
    for value in duty:
        counts.append(rig.count())
        rig.hold(value / FULL * SUPPLY)
    return _segment(kind, duty, counts, header)


def closed_loop(rig: Rig, ticks: int, reference: float, gain: float, integral_gain: float = 0.0, **header) -> Segment:
    """P or PI, written anew: latch, difference, error, command, clip, round to a duty."""
    counts, duties = [], []
    before, integral = rig.count() if rig.speed == 0 else None, 0.0
    for _ in range(ticks):
        count = rig.count()
        turned = count - before if before is not None else round(rig.speed * PERIOD * rig.counts / (2 * np.pi))
        error = reference - turned * 2 * np.pi / (rig.counts * PERIOD)
        more = integral + integral_gain * error * PERIOD
        wanted = gain * error + more
        if abs(wanted) <= SUPPLY or wanted * integral_gain * error < 0:
            integral = more
        duty = round(max(-SUPPLY, min(SUPPLY, wanted)) / SUPPLY * FULL)
        counts.append(count)
        duties.append(duty)
        rig.hold(duty / FULL * SUPPLY)
        before = count
    settings = {"reference_rad_s": reference, "gain": gain}
    if integral_gain:
        settings["integral_gain"] = integral_gain
    return _segment("closed_loop", np.array(duties), counts, settings | header)


def _segment(kind: str, duty: np.ndarray, counts: list[int], header: dict) -> Segment:
    at_rest = header.pop("at_rest", True)
    return Segment(
        kind=kind,
        start_s=0.0,
        at_rest=at_rest,
        parameters=header,
        time_s=np.arange(len(duty)) * PERIOD,
        volts=np.asarray(duty) / FULL * SUPPLY,
        tick=np.arange(len(duty)),
        duty=np.asarray(duty, dtype=np.int64),
        count=np.array(counts, dtype=np.int64),
    )


def without(segment: Segment, rows: list[int]) -> Segment:
    """The segment with rows lost."""
    names = ("time_s", "volts", "tick", "duty", "count")
    return dataclasses.replace(segment, **{name: np.delete(getattr(segment, name), rows) for name in names})


def recording(*segments: Segment, source: str = "rig.csv", **header) -> Recording:
    settings = {"period_s": PERIOD, "counts_per_rev": COUNTS, "duty_full_scale": float(FULL), "supply_V": SUPPLY}
    return Recording(segments=tuple(segments), source=source, **(settings | header))


def model(gain=11.0, pole=40.0, tau=0.0, errors=(0.01, 0.05), offset_V=0.0, fitted=()) -> Model:
    """A model with independent standard errors."""
    values = (gain, pole, tau) if tau else (gain, pole)
    covariance = np.diag(np.square(np.array([*errors, *([1e-6] if tau else [])])))
    return Model(motor(values), covariance, offset_V, PERIOD, "fit.csv", frozenset(fitted), "model.json")


@in_float64
def motor(values) -> AbstractLinearMotor:
    arrays = [jnp.asarray(float(value)) for value in values]
    return to_numpy(FirstOrder(*arrays) if len(arrays) == 2 else SecondOrder(*arrays))


def write_model(path: Path, **changes) -> Path:
    content = {
        "format": 1,
        "recording": "fit.csv",
        "model": {"gain_rad_s_V": 11.0, "pole_rad_s": 40.0, "voltage_offset_V": 0.0},
        "covariance": [[1e-4, 0.0], [0.0, 2.5e-3]],
        "period_s": PERIOD,
        "fitted_fingerprints": ["0123456789abcdef"],
    }
    path.write_text(json.dumps(content | changes))
    return path


def step(volts: float, ticks: int = 150, before: int = 5) -> np.ndarray:
    duty = round(volts / SUPPLY * FULL)
    return np.where(np.arange(ticks) < before, 0, duty)


def mean_speed(duty, gain, pole, offset_V=0.0, speed=0.0):
    """(n,) exact mean speed over each tick of a first-order motor."""
    p = np.exp(-pole * PERIOD)
    g = (1 - p) / (pole * PERIOD)
    means = []
    for volts in np.asarray(duty) / FULL * SUPPLY + offset_V:
        means.append(g * speed + gain * (1 - g) * volts)
        speed = p * speed + gain * (1 - p) * volts
    return np.array(means)
