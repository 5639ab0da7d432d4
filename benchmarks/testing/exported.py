"""Random motors, and the exported C header closing the loop on them: on the plant library and on the emulated board."""

import ctypes
import dataclasses
import json
import subprocess
from pathlib import Path

import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.control import Hardware
from jaxmotor.estimate import Model
from jaxmotor.motor import EFFECTS, linear_motor
from testing.built import BUILD, FIRMWARE
from testing.plant import Plant
from testing.wire import Script, unseal

FLAGS = ("-std=gnu11", "-Os", "-Wall", "-Wextra", "-Wshadow", "-Werror")
DUTY_DELAY_S = 40e-6
ERRORS = {"gain": 0.003, "pole": 0.015, "effect": 0.03}
"""Relative standard errors, as identification has them on a few minutes of data."""
SHIM = """
#include "motor.h"
void reference(struct motor_speed_loop *loop, int speed) { motor_speed_reference(loop, speed); }
int duty(struct motor_speed_loop *loop, int speed) { return motor_speed_duty(loop, speed); }
void integrate(struct motor_speed_loop *loop) { motor_speed_integrate(loop); }
int position(int reference, int count, int difference) { return motor_position_duty(reference, count, difference); }
int ahead(int now, int next) { return motor_feed_forward(now, next); }
int from_mrad_s(int speed) { return motor_speed_from_mrad_s(speed); }
void begin(struct motor_estimate *e, int count) { motor_estimate_begin(e, count); }
int estimated(struct motor_estimate *e, int count) { motor_estimate_count(e, count); return e->speed; }
void told(struct motor_estimate *e, int duty) { motor_estimate_duty(e, duty); }
"""


@dataclasses.dataclass(frozen=True)
class Drawn:
    """A random motor, its rig, and what an identification might have made of it."""

    hardware: Hardware
    model: Model
    toml: str
    """The plant's, with the true values."""


@in_float64
def draw(seed: int, period_ms: int | None = None) -> Drawn:
    """Motor `seed`: friction, dead zone and offset of the sizes that hobby motors have."""
    rng = np.random.default_rng(seed)
    supply = rng.uniform(6.5, 12)
    hardware = Hardware(
        period_s=(period_ms or int(rng.integers(4, 11))) / 1000,
        counts_per_rev=round(float(rng.uniform(360, 2250)), 1),
        supply_V=round(float(supply), 2),
        delay_s=DUTY_DELAY_S,
    )
    gain, pole = rng.uniform(5, 16), rng.uniform(15, 60)
    truth = {
        "coulomb_friction": supply * rng.uniform(0.02, 0.08),
        "dead_zone": supply * rng.uniform(0.02, 0.07),
        "voltage_offset": supply * rng.uniform(0.01, 0.03) * rng.choice([-1, 1]),
    }
    tables = [f"[{name}]\nvolts_V = {float(value)!r}" for name, value in truth.items()]
    toml = "\n".join(
        [
            f"[motor]\ngain_rad_s_V = {float(gain)!r}\npole_rad_s = {float(pole)!r}",
            f"[battery]\nvolts_V = {hardware.supply_V!r}",
            f"[encoder]\ncounts_per_rev = {hardware.counts_per_rev!r}",
            f"[bench]\nseed = {seed + 1}",
            *tables,
        ]
    )
    errors = {name: ERRORS["effect"] * abs(value) for name, value in truth.items()}
    found = {name: value + errors[name] * rng.normal() for name, value in truth.items()}
    deviation = np.array([ERRORS["gain"] * gain, ERRORS["pole"] * pole])
    values = np.array([gain, pole]) + deviation * rng.normal(size=2)
    model = Model(
        linear_motor(values),
        np.diag(deviation**2),
        0.0,
        hardware.period_s,
        f"motor {seed}",
        frozenset(),
        f"motor {seed}",
        tuple(to_numpy(EFFECTS[name].of(volts_V=value)) for name, value in found.items()),
        tuple({"volts_V": error} for error in errors.values()),
    )
    return Drawn(hardware, model, toml)


class Header:
    """An exported header, compiled for this machine."""

    def __init__(self, text: str, folder: Path) -> None:
        (folder / "motor.h").write_text(text)
        (folder / "shim.c").write_text(SHIM)
        library = folder / "motor.so"
        command = ["cc", *FLAGS, "-shared", "-fPIC", str(folder / "shim.c"), "-o", str(library)]
        subprocess.run(command, check=True, capture_output=True)
        self.c = ctypes.CDLL(str(library))
        # The structures are small; this is room enough for each.
        self.loop = ctypes.create_string_buffer(64)
        self.estimate = ctypes.create_string_buffer(512)

    def speed_loop(self, plant: Plant, reference: int, ticks: int, hardware: Hardware, estimated: bool = False):
        """(count, duty, true speed), each (ticks,), of the loop on `plant`; `reference` in 1/256 count per tick."""
        count, duty, speed = (np.zeros(ticks) for _ in range(3))
        before = plant.count
        self.loop = ctypes.create_string_buffer(64)
        self.c.reference(self.loop, reference)
        self.c.begin(self.estimate, before)
        for k in range(ticks):
            count[k], speed[k] = plant.count, plant.speed
            now = self.c.estimated(self.estimate, plant.count)
            shown = (now + 128) >> 8 if estimated else 256 * (plant.count - before)
            before = plant.count
            duty[k] = self.c.duty(self.loop, shown)
            self.c.told(self.estimate, int(duty[k]))
            self.c.integrate(self.loop)
            plant.sequence([int(duty[k])], period_s=hardware.period_s, delay_s=hardware.delay_s)
        return count, duty, speed

    def position_loop(self, plant: Plant, reference: int, ticks: int, hardware: Hardware) -> np.ndarray:
        """(ticks,) counts of the position loop from rest to `reference` counts farther."""
        start = before = plant.count
        count = np.zeros(ticks)
        for k in range(ticks):
            now = plant.count
            count[k] = now - start
            duty = self.c.position(reference, now - start, now - before)
            before = now
            plant.sequence([duty], period_s=hardware.period_s, delay_s=hardware.delay_s)
        return count


def on_board(
    header: str, drawn: Drawn, reference: int, ticks: int, folder: Path
) -> tuple[np.ndarray, np.ndarray, dict]:
    """(count, duty) of the exported loop on the emulated board, and the emulator's statistics.

    The board's firmware is built with the header in the place of its own loop; `reference` in 1/16 count per tick.
    """
    (folder / "motor.h").write_text(header)
    (folder / "plant.toml").write_text(drawn.toml)
    elf, stats = folder / "exported.elf", folder / "stats.json"
    make = ["make", "-C", str(FIRMWARE), "exported", f"HEADER={folder / 'motor.h'}", f"EXPORTED={elf}"]
    subprocess.run(make, check=True, capture_output=True)
    period_ms = round(1000 * drawn.hardware.period_s)
    script = Script().command("U 500000").command(f"P {period_ms} 0").command("L 9000000 1000000 6000")
    script.add("loop", ticks, 1, reference)
    bench = [str(BUILD / "bench"), "--elf", str(elf), "--plant", str(folder / "plant.toml")]
    done = subprocess.run(
        [*bench, "--stats", str(stats)], input=bytes(script.go()), check=True, capture_output=True, timeout=120
    )
    lines = [unseal(line) for line in done.stdout.splitlines() if line]
    rows = np.array([line.ints()[1:4] for line in lines if line is not None and line.type == "D"])
    return rows[:, 2], rows[:, 1], json.loads(stats.read_text())
