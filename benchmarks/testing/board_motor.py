"""A gearmotor with friction at a battery, for logs of small boards: torques in newton metres, steps of a fifth of a
millisecond. It shares nothing with the other plants but the data sheets."""

import dataclasses
import math

import numpy as np

from testing.second_motors import RPM, SHEETS

STEP_S = 2e-4


@dataclasses.dataclass
class BoardMotor:
    """All at the output shaft, in SI units. Winding inductance is neglected; a pulse acts by its mean voltage."""

    supply_V: float
    resistance: float
    torque_Nm_A: float
    inertia: float
    viscous: float
    coulomb_Nm: float
    counts_per_rev: float
    static_Nm: float = 0.0
    """Beside Coulomb friction, while it stands still; it falls off over `slow_rad_s`."""
    slow_rad_s: float = 0.1
    drag: float = 0.0
    """Torque over the square of the speed."""
    arm_Nm: float = 0.0
    """Of a level arm; its angle is that of the shaft."""
    detent_Nm: float = 0.0
    detents: int = 1
    battery_ohm: float = 0.0
    falls_per_s: float = 0.0
    """Part of the supply that is lost in a second."""
    lag_s: float = 0.0
    """Of the filter behind a tachometer."""
    seen_rad_s: float = 0.0
    """By that tachometer."""
    time_s: float = 0.0
    angle_rad: float = 0.0
    speed_rad_s: float = 0.0
    battery_V: float = 0.0

    @property
    def stall_Nm(self) -> float:
        return self.supply_V / self.resistance * self.torque_Nm_A

    def advance(self, duty: float, seconds: float) -> None:
        """With `duty`, of -1 to 1, held for `seconds`."""
        steps = max(round(seconds / STEP_S), 1)
        for _ in range(steps):
            self._step(duty, seconds / steps)
        self.time_s += seconds

    def _step(self, duty: float, step_s: float) -> None:
        """Exact for what is linear in the speed, and for dry friction until the shaft stops; drag, arm and detents act
        as in the middle of the step."""
        speed = self.speed_rad_s
        unloaded_V = self.supply_V * (1 - self.falls_per_s * self.time_s)
        # The bridge draws the winding's current for the part of time that is its duty.
        ohms = self.resistance + self.battery_ohm * duty * duty
        driven = self.torque_Nm_A * duty * unloaded_V / ohms
        damping = self.viscous + self.torque_Nm_A**2 / ohms
        half = 0.5 * step_s
        middle = speed + half * (driven - damping * speed - self._loads(speed, self.angle_rad)) / self.inertia
        loads = self._loads(middle if speed else 0.0, self.angle_rad + half * speed)
        rubs = self._rubs(speed, driven - loads)
        lasting = (driven - loads - rubs) / damping
        stops_s = self._stops_s(speed, lasting, damping)
        own_s = min(step_s, stops_s)
        left = -math.expm1(-damping * own_s / self.inertia)
        self.angle_rad += lasting * own_s + (speed - lasting) * left * self.inertia / damping
        self.speed_rad_s = 0.0 if own_s == stops_s else speed + (lasting - speed) * left
        current_A = (duty * unloaded_V - self.torque_Nm_A * self.speed_rad_s) / ohms
        self.battery_V = unloaded_V - self.battery_ohm * duty * current_A
        if self.lag_s:
            mean = 0.5 * (speed + self.speed_rad_s)
            self.seen_rad_s += (mean - self.seen_rad_s) * -math.expm1(-own_s / self.lag_s)
        if own_s < step_s:
            self._step(duty, step_s - own_s)

    def _stops_s(self, speed: float, lasting: float, damping: float) -> float:
        """Seconds until it stands still on its way to the speed `lasting`."""
        if speed == 0.0 or speed * lasting >= 0:
            return math.inf
        return self.inertia / damping * math.log1p(-speed / lasting)

    def _loads(self, speed: float, angle_rad: float) -> float:
        """Torque against the motor that is neither linear nor dry friction."""
        detents = self.detent_Nm * math.sin(self.detents * angle_rad)
        return self.drag * speed * abs(speed) + self.arm_Nm * math.sin(angle_rad) + detents

    @property
    def damping_Nm_s(self) -> float:
        """Of the shaft, by friction and back-EMF."""
        return self.viscous + self.torque_Nm_A**2 / self.resistance

    @property
    def pole_rad_s(self) -> float:
        return self.damping_Nm_s / self.inertia

    def _rubs(self, speed: float, torque: float) -> float:
        """Torque of dry friction, which stops a shaft and never turns it."""
        if speed == 0.0:
            holds = self.coulomb_Nm + self.static_Nm
            return torque if abs(torque) <= holds else math.copysign(holds, torque)
        return math.copysign(self.coulomb_Nm + self.static_Nm * math.exp(-abs(speed) / self.slow_rad_s), speed)


def draw_motor(rng: np.random.Generator) -> BoardMotor:
    """Around a data sheet; 4 to 12 % of the stall torque is Coulomb friction, as loaded hobby gears have."""
    sheet = SHEETS[rng.integers(len(SHEETS))]
    ratio = float(sheet.ratios[rng.integers(len(sheet.ratios))])
    resistance = sheet.supply_V / sheet.stall_A * rng.uniform(0.9, 1.1)
    constant = (sheet.supply_V - resistance * sheet.no_load_A) / sheet.speed_rad_s * rng.uniform(0.9, 1.1)
    rotor = 0.5 * 0.35 * sheet.motor_kg * (0.15 * sheet.can_m) ** 2 * rng.uniform(*sheet.inertia)
    torque = constant * ratio
    stall = sheet.supply_V / resistance * torque
    motor = BoardMotor(
        supply_V=sheet.supply_V,
        resistance=resistance,
        torque_Nm_A=torque,
        inertia=rotor * ratio**2,
        viscous=rng.uniform(0.02, 0.15) * torque**2 / resistance,
        coulomb_Nm=rng.uniform(0.04, 0.12) * stall,
        counts_per_rev=float(round(sheet.counts * ratio)),
    )
    # A wheel or a disc, since the rotor of these motors alone is faster than most programs look.
    wanted_s = rng.uniform(0.03, 0.15)
    return dataclasses.replace(motor, inertia=max(motor.inertia, wanted_s * torque**2 / resistance))


def rpm(speed_rad_s: float) -> float:
    return speed_rad_s / RPM
