"""Controllers on motors and a rig's hardware, from rest."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxmotor.control._hardware import Hardware
from jaxmotor.motor import AbstractController, Motor, steps_for
from jaxmotor.motor.effects import TransportDelay
from jaxmotor.prediction import Conditions, Sensors, each, simulate_loops


def run_on(
    hardware: Hardware, motors: Motor, controller: AbstractController, reference: np.ndarray, reading: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(batch, n) count at each tick, 0 at first, and (batch, n) voltage [V], of `controller` on each of `motors`.

    `reference` (n,) is what it is asked for, `reading` (batch,) where within a count each encoder begins, 0 to 1.
    """
    number = len(reading)
    if hardware.delay_s:
        late = TransportDelay(jnp.full(number, hardware.delay_s))
        motors = eqx.tree_at(lambda motor: motor.effects, motors, (*motors.effects, late))
    sensors = Sensors(reading, np.full(number, hardware.count_rad), np.zeros(number, bool))
    steps = steps_for(hardware.period_s, float(np.asarray(motors.linear.pole)[0]))
    conditions = Conditions(hardware.period_s, steps, hardware.supply_V)
    runs = simulate_loops(motors, each(controller, number), sensors, reference, conditions)
    counts = np.rint(runs["seen"] * (hardware.period_s / hardware.count_rad))
    return counts.cumsum(axis=1), runs["volts"]
