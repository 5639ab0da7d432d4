"""Programs of small boards: an encoder or a sensor is read, the duty set, a line printed.

Each has its own sensor, units, loop and format; in the motor is what the program's name says, and friction.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from testing.board_motor import BoardMotor, rpm

FULL = 255
FRICTION = frozenset({"coulomb_friction", "dead_zone", "stiction", "bristle_friction"})
"""Names of which one is right where a shaft rubs: which of them is seen depends on how it moves."""


class Printed(NamedTuple):
    """By a program."""

    lines: list[str]
    flags: list[str]
    wanted: Sequence[frozenset[str]] = ()
    """Beside friction."""
    allowed: frozenset[str] = frozenset()
    shows_friction: bool = True


Program = Callable[[BoardMotor, np.random.Generator], Printed]
Tick = tuple[float, int, BoardMotor]


def ticks(
    motor: BoardMotor, duties: Callable[[float, BoardMotor], float], seconds: float, period_s: Callable[[], float]
) -> Iterator[Tick]:
    """(time, duty, motor) as a program sees them that reads, sets the duty [-255, 255], prints and waits."""
    while motor.time_s < seconds:
        duty = int(np.clip(round(duties(motor.time_s, motor)), -FULL, FULL))
        yield motor.time_s, duty, motor
        motor.advance(duty / FULL, period_s())


def counts(motor: BoardMotor) -> int:
    return math.floor(motor.angle_rad / (2 * math.pi) * motor.counts_per_rev)


def steps(rng: np.random.Generator, held_s: float, low: int, high: int, *, both: bool = True) -> Callable[..., float]:
    """Duties that are held, at random heights from `low` to `high`, now and then none."""
    heights = rng.integers(low, high, 1000) * (rng.choice([-1, 1], 1000) if both else 1)
    heights[::7] = 0
    return lambda time_s, _: heights[int(time_s / held_s)]


def measured_battery(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """Counts every 10 ms, and the battery's voltage, which falls by a tenth and more under load."""
    motor.battery_ohm = motor.resistance * rng.uniform(0.1, 0.2)
    motor.battery_V = motor.supply_V
    lines = ["t_ms,pwm,enc,vbat_mV"]
    for time_s, duty, now in ticks(motor, steps(rng, 0.7, 60, 250), 60, lambda: 0.01):
        # The converter is read with the encoder, before the duty is set.
        lines.append(f"{1e3 * time_s:.0f},{duty},{counts(now)},{1e3 * now.battery_V:.0f}")
    return Printed(lines, _counted(motor, "t_ms:ms", "enc", "--supply-column", "vbat_mV:mV"))


def smoothed_rpm(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """Speeds every 20 ms, of counts, smoothed from row to row."""
    lines, before, smooth = ["time pwm rpm"], 0, 0.0
    share = rng.choice([0.1, 0.2, 0.3, 0.5])
    for time_s, duty, now in ticks(motor, steps(rng, 0.6, 60, 250), 60, lambda: 0.02):
        new = (counts(now) - before) / motor.counts_per_rev / 0.02 * 60
        before = counts(now)
        smooth += share * (new - smooth)
        lines.append(f"{time_s:.2f} {duty} {smooth:.2f}")
    return Printed(lines, ["--time", "time", *_duty(motor, "pwm"), "--speed", "rpm:rpm"])


def ramps(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """Slow ramps up and down in percent, and steps; plain speeds of counts every 20 ms."""
    lines, before, top = ["time_s;percent;speed"], 0, rng.uniform(70, 95)
    heights = steps(rng, 0.8, 60, 250)

    def percent(time_s: float, now: BoardMotor) -> float:
        if time_s < 30:
            return 2.55 * top * 4 * (abs((time_s / 15 + 0.75) % 1 - 0.5) - 0.25)
        return heights(time_s, now)

    for time_s, duty, now in ticks(motor, percent, 55, lambda: 0.02):
        new = (counts(now) - before) / motor.counts_per_rev / 0.02
        before = counts(now)
        lines.append(f"{time_s:.2f};{100 * duty / FULL:.3f};{360 * new:.2f}")
    supply = ["--supply", f"{motor.supply_V:g}"]
    return Printed(lines, ["--time", "time_s", "--input", "percent:percent", *supply, "--speed", "speed:deg/s"])


def speed_loop(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A speed loop with changing set points; what it prints are counts."""
    motor.static_Nm = motor.coulomb_Nm * rng.uniform(0.3, 0.8)
    motor.slow_rad_s = 0.02 * motor.supply_V / motor.torque_Nm_A
    top = motor.supply_V / motor.torque_Nm_A
    points = top * rng.choice([-0.6, -0.3, -0.1, 0.0, 0.1, 0.3, 0.6], 200)
    state = {"before": 0, "sum": 0.0}
    lines = ["t_us\tset\tpwm\tcount"]

    def pi(time_s: float, now: BoardMotor) -> float:
        seen = (counts(now) - state["before"]) / now.counts_per_rev * 2 * math.pi / 0.01
        state["before"] = counts(now)
        error = points[int(time_s)] - seen
        state["sum"] = float(np.clip(state["sum"] + error * 0.01 * 4 * FULL / top, -FULL, FULL))
        return FULL / top * error + state["sum"]

    for time_s, duty, now in ticks(motor, pi, 60, lambda: 0.01):
        lines.append(f"{1e6 * time_s:.0f}\t{rpm(points[int(time_s)]):.1f}\t{duty}\t{counts(now)}")
    return Printed(lines, _counted(motor, "t_us:us", "count"), allowed=frozenset({"torque_over_speed"}))


def arm(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A position loop that moves an arm, whose angle the board prints in degrees."""
    motor.arm_Nm = motor.stall_Nm * rng.uniform(0.1, 0.3)
    motor.counts_per_rev = max(motor.counts_per_rev, 1000.0)
    duties = _position(motor, rng, reach_rad=1.2)
    lines = ["t,u,deg"]
    for time_s, duty, now in ticks(motor, duties, 60, lambda: 0.01):
        lines.append(f"{time_s:.2f},{duty / FULL:.4f},{360 * counts(now) / now.counts_per_rev:.3f}")
    supply = ["--supply", f"{motor.supply_V:g}"]
    return Printed(
        lines, ["--time", "t", "--input", "u:duty:1", *supply, "--angle", "deg:deg"], [frozenset({"cogging"})]
    )


def detents(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A position loop; the rotor's magnets hold on to the iron."""
    motor.detents = int(rng.choice([5, 8, 12, 20]))
    motor.detent_Nm = motor.coulomb_Nm * rng.uniform(0.6, 1.2)
    motor.counts_per_rev = max(motor.counts_per_rev, 1500.0)
    lines = ["ms,pwm,ticks"]
    for time_s, duty, now in ticks(motor, _position(motor, rng, reach_rad=6.0), 60, lambda: 0.01):
        lines.append(f"{1e3 * time_s:.0f},{duty},{counts(now)}")
    return Printed(lines, _counted(motor, "ms:ms", "ticks"), [frozenset({"cogging"})])


def fan(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A propeller, driven one way; pulses of one magnet sensor since the last line."""
    top = motor.supply_V / motor.torque_Nm_A
    motor.drag = motor.stall_Nm * rng.uniform(0.4, 0.8) / top**2
    motor.counts_per_rev = float(rng.integers(60, 400))
    lines, before = ["t,duty,pulses"], 0
    for time_s, duty, now in ticks(motor, steps(rng, 0.9, 50, 255, both=False), 70, lambda: 0.01):
        lines.append(f"{time_s:.2f},{duty},{counts(now) - before}")
        before = counts(now)
    flags = ["--time", "t", *_duty(motor, "duty"), "--pulses", "pulses"]
    return Printed(lines, [*flags, "--counts-per-rev", f"{motor.counts_per_rev:g}"], [frozenset({"quadratic_drag"})])


def magnet(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A magnet on the shaft, read in 4096 steps of a turn and printed in degrees; it sits a little off the axis."""
    off, phase = rng.uniform(0.005, 0.02), rng.uniform(0, 2 * math.pi)
    _slow(motor)
    lines = ["millis,pwm,angle"]
    for time_s, duty, now in ticks(motor, steps(rng, 0.5, 60, 250), 60, lambda: 0.01):
        seen = now.angle_rad + off * math.sin(now.angle_rad + phase)
        step = math.floor(seen / (2 * math.pi) * 4096) % 4096
        lines.append(f"{1e3 * time_s:.0f},{duty},{360 * step / 4096:.2f}")
    flags = ["--time", "millis:ms", *_duty(motor, "pwm"), "--angle", "angle:deg", "--wrap", "turn"]
    return Printed(lines, flags, [frozenset({"encoder_eccentricity"})])


def tachometer(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A small dynamo behind a filter of some milliseconds, read with ten bits and printed in rpm."""
    top = motor.supply_V / motor.torque_Nm_A
    motor.lag_s = rng.uniform(0.005, 0.03)
    lines = ["t,pwm,rpm"]
    for time_s, duty, now in ticks(motor, steps(rng, 0.5, 60, 250), 60, lambda: 0.005):
        reading = round(512 + 500 * now.seen_rad_s / top + rng.normal(0, 0.7))
        lines.append(f"{time_s:.3f},{duty},{rpm((reading - 512) / 500 * top):.2f}")
    lags = frozenset({"sensor_lag", "transport_delay", "electrical_pole"})
    return Printed(lines, ["--time", "t", *_duty(motor, "pwm"), "--speed", "rpm:rpm"], [lags])


def busy_loop(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A loop that runs as fast as its other work lets it; `millis()` is its clock."""
    lines = ["millis,pwm,count"]
    for time_s, duty, now in ticks(motor, steps(rng, 0.6, 60, 250), 45, lambda: rng.uniform(0.005, 0.013)):
        lines.append(f"{math.floor(1e3 * time_s)},{duty},{counts(now)}")
    return Printed(lines, _counted(motor, "millis:ms", "count"))


def serial_port(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A computer that stamps a row, sends the duty, and asks for the count, which it gets a little later each time."""
    lines, heights = ["t,pwm,count"], steps(rng, 0.6, 60, 250)
    while motor.time_s < 45:
        time_s = motor.time_s
        duty = int(heights(time_s, motor))
        motor.advance(duty / FULL, 0.0002 + rng.exponential(0.0007))
        lines.append(f"{time_s:.6f},{duty},{counts(motor)}")
        motor.advance(duty / FULL, rng.uniform(0.006, 0.012))
    return Printed(lines, _counted(motor, "t", "count"))


def late_loop(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A loop of 20 ms that takes itself to be on time, while its radio holds it up now and then; rad/s of counts."""
    lines, before = ["t,pwm,w"], 0

    def wait_s() -> float:
        return 0.02 * (rng.uniform(3, 8) if rng.random() < 0.01 else rng.uniform(0.99, 1.03))

    for time_s, duty, now in ticks(motor, steps(rng, 0.7, 60, 250), 60, wait_s):
        speed = (counts(now) - before) / motor.counts_per_rev * 2 * math.pi / 0.02
        before = counts(now)
        lines.append(f"{time_s:.5f},{duty},{speed:.3f}")
    return Printed(lines, ["--time", "t", *_duty(motor, "pwm"), "--speed", "w:rad/s", "--speed-period", "0.02"])


def falling_battery(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A battery that falls by a few percent, which is not logged; random steps every 10 ms."""
    motor.falls_per_s = rng.uniform(0.04, 0.12) / 90
    lines = ["t,pwm,count"]
    for time_s, duty, now in ticks(motor, steps(rng, 0.25, 40, 250), 90, lambda: 0.01):
        lines.append(f"{time_s:.2f},{duty},{counts(now)}")
    return Printed(lines, _counted(motor, "t", "count"), [frozenset({"supply_drift"})])


def one_step(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """The step that everybody logs first: full duty from rest, speeds every 20 ms."""
    lines, before, begins_s = ["t_ms,pwm,rpm"], 0, rng.uniform(0.3, 1.0)
    height = int(rng.choice([128, 200, 255]))
    for time_s, duty, now in ticks(motor, lambda time_s, _: height * (time_s >= begins_s), 4, lambda: 0.02):
        new = (counts(now) - before) / motor.counts_per_rev / 0.02 * 60
        before = counts(now)
        lines.append(f"{1e3 * time_s:.0f},{duty},{new:.1f}")
    return Printed(lines, ["--time", "t_ms:ms", *_duty(motor, "pwm"), "--speed", "rpm:rpm"], shows_friction=False)


def staircase(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """Duties from none to all and back in steps of some percent, each held for half a second or more; counts."""
    held_s, step = rng.uniform(0.5, 1.2), int(rng.choice([10, 15, 25]))
    levels = [*range(0, FULL, step), FULL]
    levels = np.array([*levels, *levels[::-1], *(-x for x in levels), 0])
    seconds = held_s * len(levels)
    lines = ["time,pwm,encoder"]
    for time_s, duty, now in ticks(motor, lambda time_s, _: levels[int(time_s / held_s)], seconds - 0.01, lambda: 0.01):
        lines.append(f"{time_s:.2f},{duty},{counts(now)}")
    return Printed(lines, _counted(motor, "time", "encoder"))


def knob(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A hand on a potentiometer sets the duty; counts every 10 ms."""
    turns = np.cumsum(rng.normal(0, 1, 700))
    turns = 255 * np.sin(0.35 * turns)
    at = np.arange(700) * 0.1
    lines = ["t,pwm,count"]
    for time_s, duty, now in ticks(motor, lambda time_s, _: np.interp(time_s, at, turns), 60, lambda: 0.01):
        lines.append(f"{time_s:.2f},{duty},{counts(now)}")
    return Printed(lines, _counted(motor, "t", "count"))


def potentiometer(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A servo: a position loop on a potentiometer of 270 degrees, read with ten bits and some noise."""
    _slow(motor)
    points, state = rng.uniform(-1.8, 1.8, 200), {"seen": 0.0, "before": 0.0}
    top = motor.supply_V / motor.torque_Nm_A

    def read(now: BoardMotor) -> int:
        return round(512 + now.angle_rad / math.radians(270) * 1024 + rng.normal(0, 0.8))

    def pd(time_s: float, now: BoardMotor) -> float:
        state["before"], state["seen"] = state["seen"], (read(now) - 512) / 1024 * math.radians(270)
        speed = (state["seen"] - state["before"]) / 0.01
        return FULL * (1.5 * (points[int(time_s / 0.9)] - state["seen"]) - 0.3 * speed / top)

    lines = ["ms;u;grad"]
    for time_s, duty, _ in ticks(motor, pd, 60, lambda: 0.01):
        lines.append(f"{1e3 * time_s:.0f};{duty};{math.degrees(state['seen']):.2f}")
    return Printed(lines, ["--time", "ms:ms", *_duty(motor, "u"), "--angle", "grad:deg"])


def pulse_times(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """Speeds from the time between the last two edges, driven one way; a motor with few edges in a turn."""
    # Some hundred edges in a second at the top speed.
    motor.counts_per_rev = float(round(rng.uniform(300, 900) * 2 * math.pi * motor.torque_Nm_A / motor.supply_V))
    edges, last, speed = [0.0, 0.0], 0, 0.0
    lines, heights = ["t,pwm,rpm"], steps(rng, 0.8, 60, 255, both=False)
    while motor.time_s < 60:
        duty = int(heights(motor.time_s, motor))
        lines.append(f"{motor.time_s:.2f},{duty},{speed:.2f}")
        for _ in range(50):
            motor.advance(duty / FULL, 2e-4)
            if counts(motor) > last:
                # `micros()` tells when it came, in steps of 4 microseconds.
                beyond = motor.angle_rad - counts(motor) * 2 * math.pi / motor.counts_per_rev
                came_s = 4e-6 * round((motor.time_s - beyond / motor.speed_rad_s) / 4e-6)
                edges, last = [edges[1], came_s], counts(motor)
                speed = 60 / motor.counts_per_rev / (edges[1] - edges[0])
            elif motor.time_s - edges[1] > 0.1:
                speed = 0.0
    flags = ["--time", "t", *_duty(motor, "pwm"), "--speed", "rpm:rpm"]
    return Printed(lines, [*flags, "--speed-pulses", f"{motor.counts_per_rev:g}"])


def slow_print(motor: BoardMotor, rng: np.random.Generator) -> Printed:
    """A speed loop of 5 ms that prints every tenth time: what it drove in between nobody knows."""
    top = motor.supply_V / motor.torque_Nm_A
    points = top * rng.choice([-0.6, -0.4, 0.2, 0.4, 0.6], 200)
    state = {"sum": 0.0, "before": 0, "number": 0}

    def pi(time_s: float, now: BoardMotor) -> float:
        seen = (counts(now) - state["before"]) / now.counts_per_rev * 2 * math.pi / 0.005
        state["before"] = counts(now)
        error = points[int(time_s / 1.5)] - seen
        state["sum"] = float(np.clip(state["sum"] + error * 0.005 * 4 * FULL / top, -FULL, FULL))
        return 0.7 * FULL / top * error + state["sum"]

    lines = ["t,pwm,count"]
    for number, (time_s, duty, now) in enumerate(ticks(motor, pi, 60, lambda: 0.005)):
        if number % 10 == 0:
            lines.append(f"{time_s:.3f},{duty},{counts(now)}")
    return Printed(lines, _counted(motor, "t", "count"), shows_friction=False)


def _position(motor: BoardMotor, rng: np.random.Generator, reach_rad: float) -> Callable[..., float]:
    """Duties of a loop with changing set points within `reach_rad`."""
    points = rng.uniform(-reach_rad, reach_rad, 200)
    top, damped = motor.supply_V / motor.torque_Nm_A, {"before": 0.0}

    def pd(time_s: float, now: BoardMotor) -> float:
        seen = counts(now) / now.counts_per_rev * 2 * math.pi
        speed, damped["before"] = (seen - damped["before"]) / 0.01, seen
        return FULL * (1.5 * (points[int(time_s / 1.2)] - seen) - 0.5 * speed / top)

    return pd


def _slow(motor: BoardMotor) -> None:
    """Through a larger gear, so that a turn takes half a second and more."""
    top = motor.supply_V / motor.torque_Nm_A
    gear = max(top / 10, 1.0)
    motor.torque_Nm_A *= gear
    motor.coulomb_Nm *= gear
    motor.inertia *= gear**2
    motor.viscous *= gear**2


def _duty(motor: BoardMotor, column: str) -> list[str]:
    return ["--input", f"{column}:duty:{FULL}", "--supply", f"{motor.supply_V:g}"]


def _counted(motor: BoardMotor, time: str, column: str, *supply: str) -> list[str]:
    own = ["--time", time, *_duty(motor, "pwm"), "--count", column]
    return [*own, "--counts-per-rev", f"{motor.counts_per_rev:g}", *supply]


PROGRAMS: dict[str, Program] = {
    one.__name__: one
    for one in (
        measured_battery,
        smoothed_rpm,
        ramps,
        speed_loop,
        arm,
        detents,
        fan,
        magnet,
        tachometer,
        busy_loop,
        serial_port,
        late_loop,
        falling_battery,
        one_step,
        staircase,
        knob,
        potentiometer,
        pulse_times,
        slow_print,
    )
}
