"""Logs whose counts are latched a part of a tick before or after the voltage changes, and which do not say so.

    make -C firmware plant && python benchmarks/timing.py [MOTORS] [--friction]

Random motors on random plans without closed loops, in the emulated bench's plant; nothing else is hidden, or Coulomb
friction of 2 to 8 % of the supply. For each: by
how much the offset is found wrong [% of a tick], whether the 95 % intervals of gain and pole hold the truth (from
`identify`, from `diagnose`), and what `diagnose` says.
"""

import argparse
from typing import Any, NamedTuple

import numpy as np
from hidden import plant_file
from testing.hidden_plans import Loop, draw_plan, draw_rig
from testing.plant import Plant

from jaxmotor.diagnosis import diagnose
from jaxmotor.estimate import Timing, identify
from jaxmotor.recording import Recording, Segment

MOTORS = 40
LARGEST = 0.5
"""Of a tick."""
STILL_S = 0.5
NEAR = 2.0
"""Error of the offset that is near enough [% of a tick]."""


class Truth(NamedTuple):
    """What is behind a recording."""

    period_s: float
    offset_s: float
    gain: float
    """[rad/s/V]"""
    pole: float
    """[rad/s]"""


def late_recording(
    seed: int, largest: float = LARGEST, most: int = 100, friction: bool = False
) -> tuple[Recording, Truth]:
    """A recording whose counts are off by up to `largest` of a tick, of at most `most` segments; what is behind it."""
    rng = np.random.default_rng([seed, 15])
    rig = draw_rig(rng)
    offset = rng.uniform(-largest, largest) * rig.period_s
    plan = [experiment for experiment in draw_plan(rig, rng) if not isinstance(experiment.drive, Loop)]
    segments, start, rest = [], 0.0, STILL_S + 12 / rig.pole
    hidden = {"coulomb_friction": {"volts_V": rng.uniform(0.02, 0.08) * rig.supply_V}} if friction else {}
    with Plant(plant_file(rig, hidden)) as plant:
        for experiment in plan[:most]:
            plant.hold(0.0, rest)
            start = round(start + rest, 6)
            duty = np.asarray(experiment.drive, np.int64)
            count = latched(plant, duty / rig.full_scale, rig.period_s, offset)
            tick, volts = np.arange(len(duty)), duty / rig.full_scale * rig.supply_V
            about = (experiment.kind, start, True, dict(experiment.parameters), tick * rig.period_s, volts)
            segments.append(Segment(*about, tick=tick, duty=duty, count=count))
            start += len(duty) * rig.period_s
    recording = Recording(
        tuple(segments),
        f"timing {seed}",
        period_s=rig.period_s,
        counts_per_rev=rig.counts_per_rev,
        duty_full_scale=float(rig.full_scale),
        supply_V=rig.supply_V,
        drive="brake",
    )
    return recording, Truth(rig.period_s, offset, rig.gain, rig.pole)


def latched(plant: Plant, duty: np.ndarray, period_s: float, offset_s: float) -> np.ndarray:
    """(n,) counts, each read `offset_s` after its duty is set (before it where that is negative)."""
    count = np.zeros(len(duty), np.int64)
    for k, own in enumerate(duty):
        if offset_s > 0:
            plant.hold(own, offset_s)
        count[k] = plant.count
        if offset_s < 0:
            plant.hold(duty[k - 1] if k else 0.0, -offset_s)
        plant.hold(own, period_s - abs(offset_s))
    return count


def assessed(found: Timing | None, motor: Any, errors: tuple[float, float], truth: Truth) -> tuple[float, float, float]:
    """By how much the offset is wrong [% of a tick], gain and pole [standard errors]."""
    off = 100 * ((found.offset_s if found else 0.0) - truth.offset_s) / truth.period_s
    gain = (float(motor.gain) - truth.gain) / errors[0]
    return off, gain, (float(motor.pole) - truth.pole) / errors[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motors", metavar="MOTORS", nargs="?", type=int, default=MOTORS)
    parser.add_argument("--friction", action="store_true")
    chosen = parser.parse_args()
    motors = chosen.motors
    print("                    identify               diagnose")
    print("seed  tick  offset  offset   gain   pole   offset   gain   pole")
    print("        ms  % tick  % tick  s. e.  s. e.   % tick  s. e.  s. e.   verdict, effects")
    every, named = [], 0
    for seed in range(motors):
        recording, truth = late_recording(seed, friction=chosen.friction)
        fit, diagnosis = identify(recording), diagnose(recording)
        error = diagnosis.standard_error
        own = assessed(fit.timing, fit.motor, (float(fit.standard_error.gain), float(fit.standard_error.pole)), truth)
        its = assessed(diagnosis.timing, diagnosis.motor.linear, (error["gain_rad_s_V"], error["pole_rad_s"]), truth)
        names = ", ".join([diagnosis.verdict, *(effect.name for effect in diagnosis.effects)])
        head = f"{seed:4d} {1e3 * truth.period_s:5.0f} {100 * truth.offset_s / truth.period_s:7.1f}"
        print(head, *(f"{off:7.2f} {gain:6.2f} {pole:6.2f} " for off, gain, pole in (own, its)), names, flush=True)
        every.append((own, its))
        named += bool(diagnosis.effects)
    for name, (off, gain, pole) in zip(("identify", "diagnose"), np.abs(every).transpose(1, 2, 0), strict=True):
        print(
            f"{name}: offset within {NEAR:g} % of a tick in {100 * np.mean(off < NEAR):.0f} % (largest {off.max():.2f} "
            f"%); inside 95 %: gain {100 * np.mean(gain < 1.96):.0f} %, pole {100 * np.mean(pole < 1.96):.0f} %"
        )
    print(f"an effect is named in {named} of {motors}")


if __name__ == "__main__":
    main()
