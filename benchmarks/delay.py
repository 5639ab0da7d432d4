"""The paper's "more delay than our model", seen on the emulated bench's motor and taken apart.

    make firmware && python benchmarks/delay.py

Seen: the phase that the paper's processing reads (count difference, stamped at its end, eq. 12-14 over all rows) less
the phase of its model G ZOH with the motor's own gain and pole. Its parts, each computed alone, in degrees:

    difference the difference to the previous count, arg z⁻¹V - arg G ZOH: a formula
    L/R        the electrical lag, second order less first: a formula
    timer      the board applies a duty 40 us after the tick, -ω 40 us
    duty       the fundamental of the stepped duty against the sine that was meant
    start      what the start-up transient does to a fit over all rows
    friction   the motor with friction less the same motor without, both through the same processing
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from testing.plant import FULL_SCALE, Plant

from jaxmotor.motor import FirstOrder, SecondOrder, mean_speed_response, paper_response, unmodelled_by_paper

PERIOD_S, SUPPLY_V, AMPLITUDE_V, COUNTS = 0.005, 7.4, 5.1, 617.4
DUTY_DELAY_S = 40e-6
FREQUENCIES_HZ = (0.503, 1.007, 2.009, 3.011, 5.017, 7.023, 10.031)
TICKS = 1600


class Parts(NamedTuple):
    """Degrees at each frequency; lead is positive."""

    seen: np.ndarray
    difference: np.ndarray
    electrical: np.ndarray
    timer: np.ndarray
    duty: np.ndarray
    start: np.ndarray
    friction: np.ndarray

    @property
    def together(self) -> np.ndarray:
        """Sum of the parts."""
        return sum(self[1:], np.zeros(len(self.seen)))


def fitted(signal: np.ndarray, frequency: float, first: int) -> complex:
    """A exp(jφ) of A sin(2πft + φ), by least squares over rows from tick `first` on (eq. 12-14)."""
    angle = 2 * np.pi * frequency * np.arange(first, first + len(signal)) * PERIOD_S
    sine, cosine = np.linalg.lstsq(np.stack([np.sin(angle), np.cos(angle)], axis=1), signal)[0]
    return complex(sine, cosine)


def duties(frequency: float) -> np.ndarray:
    """The board's duty of a sine of 5.1 V."""
    wanted = AMPLITUDE_V / SUPPLY_V * np.sin(2 * np.pi * frequency * np.arange(TICKS) * PERIOD_S)
    return np.rint(FULL_SCALE * wanted).astype(np.int32)


def read(toml: str, frequency: float, delay_s: float) -> complex:
    """What the paper's processing reads of the plant `toml`, from its counts."""
    with Plant(toml) as plant:
        count = plant.sequence(duties(frequency), period_s=PERIOD_S, delay_s=delay_s).count
    return fitted(np.diff(count) * 2 * np.pi / (COUNTS * PERIOD_S), frequency, 1)


def degrees(ratio: np.ndarray) -> np.ndarray:
    return np.rad2deg(np.angle(ratio))


def parts(friction_V: float) -> Parts:
    """All parts for a motor with Coulomb friction of `friction_V` at the winding."""
    rough = f"[coulomb_friction]\nvolts_V = {friction_V}\n" if friction_V else ""
    with Plant("") as plant:
        linear = plant.linear
    with jax.enable_x64(True):
        first = FirstOrder(jnp.asarray(linear.gain), jnp.asarray(linear.pole))
        second = SecondOrder(first.gain, first.pole, jnp.asarray(linear.electrical_time_constant))
        frequency, period = jnp.asarray(FREQUENCIES_HZ), jnp.asarray(PERIOD_S)
        model = np.asarray(paper_response(first, frequency, period))
        count = np.asarray(unmodelled_by_paper(first, frequency, period))
        exact = np.asarray(mean_speed_response(first, frequency, period))
        lag = np.asarray(mean_speed_response(second, frequency, period)) / exact
    smooth = np.array([read("", f, DUTY_DELAY_S) for f in FREQUENCIES_HZ])
    seen = np.array([read(rough, f, DUTY_DELAY_S) for f in FREQUENCIES_HZ])
    stepped = np.array([fitted(duties(f).astype(float), f, 0) for f in FREQUENCIES_HZ])
    started = np.array([_started(linear.gain, linear.pole, f) for f in FREQUENCIES_HZ])
    steady = exact * np.exp(-2j * np.pi * np.array(FREQUENCIES_HZ) * PERIOD_S) * AMPLITUDE_V
    timer = -360 * np.array(FREQUENCIES_HZ) * DUTY_DELAY_S
    return Parts(
        degrees(seen / model), degrees(count), degrees(lag), timer, degrees(stepped), degrees(started / steady),
        degrees(seen / smooth),
    )  # fmt: skip


def _started(gain: float, pole: float, frequency: float) -> complex:
    """The reading of an exact first-order motor that starts at rest under the unstepped sine, without an encoder."""
    volts = AMPLITUDE_V * np.sin(2 * np.pi * frequency * np.arange(TICKS) * PERIOD_S)
    p = np.exp(-pole * PERIOD_S)
    g = (1 - p) / (pole * PERIOD_S)
    speed, mean = 0.0, np.empty(TICKS)
    for k, u in enumerate(volts):
        mean[k] = g * speed + gain * (1 - g) * u
        speed = p * speed + gain * (1 - p) * u
    return fitted(mean[:-1], frequency, 1)


def main() -> None:
    for friction in (0.0, 0.2, 0.5):
        found = parts(friction)
        print(f"friction {friction:g} V; degrees, lead is positive")
        print("    Hz " + "".join(f"{name:>11s}" for name in (*Parts._fields, "together")))
        for k, frequency in enumerate(FREQUENCIES_HZ):
            row = [values[k] for values in (*found, found.together)]
            print(f"{frequency:7.3f}" + "".join(f"{value:11.2f}" for value in row))
        print(f"seen less together: at most {np.abs(found.seen - found.together).max():.2f} degrees\n")


if __name__ == "__main__":
    main()
