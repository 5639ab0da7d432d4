"""Draws how each effect shows: docs/img/effects/NAME.png, one for each page of docs/effects.

    python benchmarks/effect_signatures.py [NAME...]

Left, the speed that the encoder shows with the effect and without. Right, what the linear motor lacks, against the
coordinate that the effect depends on: the voltage that would make the linear motor move as this one does, tick by tick,

    m[k] = (w[k+1] - p w[k])/(K (1 - p)) - u[k],   p = exp(-a T),

or for sensors what the reading adds to the speed. Gain 10.6 rad/s/V, pole 40 rad/s, 5 ms, 7.4 V, no rounding.
"""

import sys
from pathlib import Path
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from _pictures import save_small
from matplotlib.figure import Figure

from jaxmotor._precision import in_float64
from jaxmotor.motor import EFFECTS, FirstOrder, Motor, Rows, simulate_motor
from jaxmotor.present._style import BLUE, EXACT, GREY, REFERENCE, panels, styled

FOLDER = Path(__file__).parent.parent / "docs" / "img" / "effects"
GAIN, POLE, PERIOD_S, SUPPLY_V, VISCOUS_SHARE = 10.6, 40.0, 0.005, 7.4, 0.045
TICKS = 2000
Against = Literal["speed", "voltage", "torque", "angle", "time"]
LABELS = {
    "speed": "Speed (rad/s)",
    "voltage": "Voltage (V)",
    "torque": "Voltage less back-EMF (V)",
    "angle": "Shaft angle (rad)",
    "time": "Time (s)",
}


class Case(NamedTuple):
    """An effect of hobby size, what is done to the motor, and what its signature is drawn against."""

    sizes: dict[str, float]
    signal: str
    against: Against
    window_s: tuple[float, float] = (0.2, 0.8)
    beside: dict[str, dict[str, float]] = {}  # noqa: RUF012
    """Effects that it does not come without."""


class Seen(NamedTuple):
    """What a motor did, tick by tick."""

    speed: np.ndarray
    """At the tick [rad/s]."""
    turn: np.ndarray
    """[rad]"""
    shown: np.ndarray
    """Mean speed over the tick as the encoder shows it [rad/s]."""


CASES = {
    "transport_delay": Case({"delay_s": 0.0043}, "steps", "time"),
    "dead_zone": Case({"volts_V": 0.35}, "sweep", "voltage", (4.3, 5.7)),
    "input_threshold": Case({"volts_V": 0.6}, "sweep", "voltage", (4.3, 5.7)),
    "voltage_offset": Case({"volts_V": 0.15}, "sweep", "voltage", (4.3, 5.7)),
    "voltage_saturation": Case({"volts_V": 6.2}, "sweep", "voltage", (1.5, 3.5)),
    "direction_asymmetry": Case({"ratio": 0.05}, "sweep", "voltage", (0.0, 10.0)),
    "supply_sag": Case({"ratio": 0.25}, "steps", "torque"),
    "supply_drift": Case({"rate_per_s": 0.02}, "train", "time", (0.0, 10.0)),
    "coast_drive": Case({}, "sweep", "voltage", (0.0, 10.0), {"coulomb_friction": {"volts_V": 0.4}}),
    "current_limit": Case({"volts_V": 3.5}, "steps", "torque"),
    "electrical_pole": Case({"time_constant_s": 0.004}, "steps", "time"),
    "coulomb_friction": Case({"volts_V": 0.4}, "sweep", "speed", (4.3, 5.7)),
    "stiction": Case(
        {"volts_V": 0.3, "static_volts_V": 0.55, "stribeck_speed_rad_s": 6.0}, "sweep", "speed", (4.3, 5.7)
    ),
    "quadratic_drag": Case({"volts_V_s2_rad2": 2e-4}, "sweep", "speed", (0.0, 10.0)),
    "cogging": Case({"volts_V": 0.3, "cycles_per_rev": 6.0, "phase_rad": 0.7}, "crawl", "angle", (0.0, 1.5)),
    "load_torque": Case({"volts_V": 0.3}, "sweep", "speed", (4.3, 5.7)),
    "winding_heating": Case({"rise_ratio": 2.0, "time_constant_s": 5.0}, "train", "time", (8.98, 9.4)),
    "shaft_compliance": Case(
        {"frequency_Hz": 18.0, "damping_ratio": 0.08, "inertia_ratio": 0.4}, "steps", "time", (0.2, 0.6)
    ),
    "backlash": Case({"gap_rad": 0.04, "inertia_ratio": 0.4}, "swing", "time", (1.0, 2.5)),
    "encoder_eccentricity": Case(
        {"amplitude_rad": 0.03, "cycles_per_rev": 1.0, "phase_rad": 0.4}, "crawl", "angle", (0.0, 3.0)
    ),
    "missed_counts": Case({"ratio": 0.06, "speed_rad_s": 40.0}, "sweep", "speed", (0.0, 10.0)),
    "sensor_lag": Case({"time_constant_s": 0.006}, "steps", "time"),
    "cubic_drive": Case({"cubic_1_V2": 2e-3}, "sweep", "voltage", (0.0, 10.0)),
    "dead_time": Case({"volts_V": 0.3}, "steps", "torque"),
    "cubic_drag": Case({"volts_V": 0.2}, "sweep", "speed", (0.0, 10.0)),
    "sector_friction": Case({"volts_V": 0.4, "centre_rad": 2.0, "width_rad": 1.2}, "crawl", "angle", (0.0, 1.5)),
    "warming_friction": Case({"volts_V": 0.3, "rise_ratio": 0.8, "time_constant_s": 3.0}, "train", "time", (0.0, 0.6)),
    "bristle_friction": Case({"volts_V": 0.4, "deflection_rad": 0.1}, "swing", "time", (1.0, 2.5)),
}


def signal(name: str) -> np.ndarray:
    """(TICKS,) voltages [V]."""
    tick = np.arange(TICKS)
    if name == "sweep":
        return np.interp(tick, [0, 500, 1500, 1999], [0, SUPPLY_V, -SUPPLY_V, 0])
    if name == "swing":
        return 3 * np.sin(2 * np.pi * tick * PERIOD_S)
    if name == "crawl":
        return np.full(TICKS, 1.2)
    levels = [0.0, 5.1, -5.1, 2.5, 0.0, 1.0, -2.5, 7.0] if name == "steps" else [0.0, 5.1, 0.0, -5.1]
    return np.resize(np.repeat(levels, 50), TICKS)


@in_float64
def moved(name: str | None, case: Case) -> Seen:
    """The motor with the effect `name`, or without any."""
    effects = () if name is None else (EFFECTS[name].of(**case.sizes),)
    if name is not None:
        effects += tuple(EFFECTS[other].of(**sizes) for other, sizes in case.beside.items())
    motor = Motor(FirstOrder(jnp.asarray(GAIN), jnp.asarray(POLE)), effects, jnp.asarray(VISCOUS_SHARE))
    reset = np.zeros(TICKS, bool)
    reset[0] = True
    rows = Rows(
        jnp.asarray(signal(case.signal)),
        jnp.asarray(reset),
        jnp.zeros(TICKS),
        jnp.asarray(np.arange(TICKS) * PERIOD_S),
    )
    run = jax.jit(simulate_motor)(motor, rows, jnp.asarray(PERIOD_S), jnp.asarray(SUPPLY_V), jnp.asarray(10))
    return Seen(np.asarray(run.speed), np.asarray(run.turn), np.asarray(run.sensed_turn) / PERIOD_S)


def lacking(name: str, case: Case, seen: Seen) -> np.ndarray:
    """(TICKS - 1,) what the linear motor lacks [V], for sensors what the reading adds [rad/s]."""
    if EFFECTS[name].acts_on == "sensor":
        return (seen.shown - seen.turn / PERIOD_S)[:-1]
    kept = np.exp(-POLE * PERIOD_S)
    return (seen.speed[1:] - kept * seen.speed[:-1]) / (GAIN * (1 - kept)) - signal(case.signal)[:-1]


def coordinate(case: Case, seen: Seen) -> np.ndarray:
    """(TICKS - 1,)"""
    volts = signal(case.signal)
    return {
        "speed": seen.turn / PERIOD_S,
        "voltage": volts,
        "torque": volts - seen.turn / PERIOD_S / GAIN,
        "angle": (np.cumsum(seen.turn) - seen.turn / 2) % (2 * np.pi),
        "time": np.arange(TICKS) * PERIOD_S,
    }[case.against][:-1]


@styled
def signature(name: str, case: Case, seen: Seen, linear: Seen) -> Figure:
    """The two panels of one effect."""
    figure, axes = panels(1, 1.9, columns=2, share_x=False)
    left, right = axes[0]
    time = np.arange(TICKS) * PERIOD_S
    drawn = (time >= case.window_s[0]) & (time < case.window_s[1])
    left.plot(time[drawn], seen.shown[drawn], label=name, **EXACT)
    left.plot(time[drawn], linear.shown[drawn], label="linear", **REFERENCE)
    left.set(xlabel="Time (s)", ylabel="Speed shown (rad/s)")
    left.legend(loc="lower left", bbox_to_anchor=(-0.25, 1.0), ncols=2)
    x, y = coordinate(case, seen), lacking(name, case, seen)
    if case.against == "time":
        shown = slice(None) if case.signal == "train" else drawn[:-1]
        right.plot(x[shown], y[shown], color=BLUE, linewidth=0.9)
    else:
        right.plot(x[50:], y[50:], color=BLUE, linestyle="none", marker=".", markersize=1.5)
    right.axhline(0, color=GREY, linewidth=0.6)
    if np.ptp(y) < 1e-3:
        right.set_ylim(min(0, y.min()) * 1.5, max(0, y.max()) * 1.5)
    sensor = EFFECTS[name].acts_on == "sensor"
    right.set(xlabel=LABELS[case.against], ylabel="Added speed (rad/s)" if sensor else "Missing voltage (V)")
    return figure


def draw(name: str, folder: Path) -> Path:
    """Write the picture of the effect `name` into `folder`."""
    case = CASES[name]
    figure = signature(name, case, moved(name, case), moved(None, case))
    return save_small(figure, folder / f"{name}.png")


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or CASES:
        path = draw(name, FOLDER)
        print(f"{path.stem:22s} {path.stat().st_size / 1e3:5.1f} kB")


if __name__ == "__main__":
    main()
