"""Linear motors identified from measured logs of six rigs: the table of docs/real-data.md.

    python benchmarks/real_data.py [--diagnose [LOG...]]

The logs are looked for in $JAXMOTOR_DATA, else in ../shared/data beside the checkout. Each is fitted and scored on
itself, to compare with fits that others made by hand; the fits by hand are first order without delay or friction.
Of the last four rigs the table tells what their logs do not state, as it is assumed: supply, counts per turn, and that
a metre is a radian.
"""

import argparse
import os
import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxmotor import JaxmotorError, Motor, Recording, diagnose, identify, import_log, import_steady, join
from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import FoundEffect
from jaxmotor.estimate import Noise
from jaxmotor.motor import Rows, simulate_motor
from jaxmotor.motor.effects import told_parameters

FOLDER = Path(os.environ.get("JAXMOTOR_DATA", Path(__file__).parent.parent.parent / "shared" / "data"))
FLEXIBLE: dict[str, Any] = {"input": "u_pwm200:duty:200", "count": "count", "counts_per_rev": 1000, "supply_V": 12.0}
BY_HAND = {
    "brake/prbs_open": 78.7,
    "brake/step_open": 90.3,
    "coast/prbs_open": 28.3,
    "coast/step_open": 38.0,
    "emps/position_1ms": 83.9,
    "emps/position_10ms": 83.9,
    "flexible_link/swept1": 48.6,
    "wheel/m1": 94.4,
    "speed_loop/demo2": 86.8,
}
OTHERS: dict[str, dict[str, Any]] = {
    "emps/position_1ms": {"input": "u_V:V", "angle": "y_m:rad"},
    "emps/position_10ms": {"input": "u_V:V", "angle": "y_m:rad"},
    "flexible_link/swept1": FLEXIBLE,
    "flexible_link/swept3": FLEXIBLE,
    "flexible_link/step1": FLEXIBLE,
    "flexible_link/step2": FLEXIBLE,
    "wheel/m1": {"input": "pwm_pct:percent", "speed": "w_rad_per_s:rad/s", "supply_V": 12.0},
    "speed_loop/demo2": {
        "input": "duty:duty:255",
        "speed": "w_rad_per_s:rad/s",
        "supply_V": 5.0,
        "speed_window_s": 0.05,
    },
}
"""How `import_log` reads logs of other rigs."""
FILES = (
    "brake/prbs_open",
    "brake/step_open",
    "brake/stairs_closed",
    "brake/step_closed",
    "brake/profile_closed",
    "coast/prbs_open",
    "coast/step_open",
    "coast/stairs_closed",
    "coast/step_closed",
    "coast/profile_closed",
    *OTHERS,
)


def measured(name: str) -> Recording:
    """The log `name` (`brake/prbs_open`) as a recording: of the first two rigs speeds over 20 ms, or angles."""
    if name in OTHERS:
        return import_log(FOLDER / f"{name}.csv", time="t_s", **OTHERS[name])
    path = FOLDER / f"undcmotor_{name}.csv"
    columns = next(line for line in path.read_text().splitlines() if not line.startswith("#"))
    if "y_deg_per_s" in columns:
        return import_log(path, time="t_s", input="u_V:V", speed="y_deg_per_s:deg/s", speed_window_s=0.02, supply_V=5.0)
    return import_log(path, time="t_s", input="u_V:V", angle="y_deg:deg", supply_V=5.0)


def row(name: str) -> str:
    recording = measured(name)
    rows = sum(map(len, recording.segments))
    try:
        fit = identify(recording)
    except JaxmotorError as error:
        return f"| {name} | {rows} | | | | | | | {str(error).partition(': ')[2]} |"
    gain, pole = float(fit.motor.gain), float(fit.motor.pole)
    errors = [1.96 * float(fit.standard_error.gain), 1.96 * float(fit.standard_error.pole)]
    by_hand = f"{BY_HAND[name]:.1f}" if name in BY_HAND else ""
    return (
        f"| {name} | {rows} | {gain:.3g} ± {errors[0]:.2g} | {pole:.3g} ± {errors[1]:.2g} | {1e3 * fit.offset_V:.0f} | "
        f"{fit.fit_percent:.1f} | {by_hand} | {noise_cell(fit.noise)} | {fit.chi2_per_sample:.3g} |"
    )


def noise_cell(noise: Noise) -> str:
    """Level, what is new in each row, and step, in the log's unit; of angles those of the turn from row to row."""
    step = "none" if noise.step is None else f"{noise.step / noise.unit.si:.3g}"
    if noise.known:
        return f"rounding to whole {noise.unit.name}"
    return f"{noise.level / noise.unit.si:.3g}, {noise.row_to_row / noise.unit.si:.3g}, {step} {noise.unit.name}"


JOINED = "coast/static_gain, prbs_open, step_open"
DIAGNOSED = (*FILES, JOINED)


def static_curve() -> Recording:
    """The steady states of the coasting motor."""
    path = FOLDER / "undcmotor_coast" / "static_gain.csv"
    return import_steady(
        path, input="u:V", speed="y:deg/s", period_s=0.02, hold_s=2.0, speed_window_s=0.02, supply_V=5.0
    )


def static_fit(motor: Motor, curve: Recording) -> float:
    """100 (1 - |y - ŷ|/|y - mean y|) of the speeds [rad/s] at which `motor` settles from rest."""
    rows = [segment for segment in curve.segments if segment.speed_rad_s is not None]
    volts = np.array([segment.volts[0] for segment in rows])
    speeds = np.array([segment.speed_rad_s[0] for segment in rows if segment.speed_rad_s is not None])
    number = 2000

    def settled(volt: jax.Array) -> jax.Array:
        ticks = jnp.arange(number)
        zero = jnp.zeros(number)
        done = Rows(jnp.full(number, volt), ticks == 0, zero, ticks * 0.02)
        return simulate_motor(motor, done, jnp.asarray(0.02), jnp.asarray(5.0), 10).speed[-1]

    with jax.enable_x64(True):
        reached = np.asarray(jax.jit(jax.vmap(settled))(jnp.asarray(volts)))
    return 100 * (1 - float(np.linalg.norm(speeds - reached) / np.linalg.norm(speeds - speeds.mean())))


def diagnosed(name: str) -> str:
    curve = static_curve()
    if name == JOINED:
        recording = join([measured("coast/prbs_open"), measured("coast/step_open"), curve])
    else:
        recording = measured(name)
    begin = time.perf_counter()
    found = diagnose(recording)
    seconds = time.perf_counter() - begin
    told = "; ".join(map(told_cell, found.named)) or "nothing"
    more = f"; static fit {static_fit(found.motor, curve):.2f}" if name == JOINED else ""
    more += f" | {found.whole.angle_fit_percent_after:.1f}"
    return (
        f"| {name} | {told} | {found.whole.before.fit_percent:.1f} | {found.whole.after.fit_percent:.2f}{more} "
        f"| {found.outcome} | {seconds:.0f} |"
    )


def told_cell(found: FoundEffect) -> str:
    """A cause with its size and probability, "of" that of it or what the log does not tell from it; where no name is
    sure the family, and what it is most like; else what is unsure."""
    law = found.effect
    sizes = ", ".join(f"{found.parameters[name]:.3g}" for name in told_parameters(law) if name in found.parameters)
    own = f"{found.probability:.2f}"
    if any(one.inseparable for one in found.alternatives):
        own += f" of {found.family_probability:.2f}"
    effect = f"{found.name.replace('_', ' ')} {sizes}".strip() + f" ({own})"
    if found.is_named:
        return effect
    return (
        f"{law.family or 'a law'} ({found.of_family:.2f}), most like {effect}" if found.is_told else f"unsure: {effect}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--diagnose", nargs="*", metavar="LOG", help="diagnose these instead, or some")
    chosen = parser.parse_args().diagnose
    if not FOLDER.is_dir():
        print(f"no measured logs in {FOLDER}; name their folder with JAXMOTOR_DATA")
        return
    if chosen is not None:
        keep_programs(threads=True)
        print("| log | told | linear, fit % | with it, fit % | of the angle | verdict | s |")
        print("|---|---|---|---|---|---|---|")
        for name in chosen or DIAGNOSED:
            print(diagnosed(name), flush=True)
        return
    columns = "log | rows | gain [rad/s/V] | pole [rad/s] | offset [mV] | fit % | by hand %"
    print(f"| {columns} | noise: level, new, step | chi2 |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in FILES:
        print(row(name))


if __name__ == "__main__":
    main()
