"""Motors in closed loops: what a controller sees of them, and what it applies."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.motor import AbstractController, InitialAngle, Motor, Rows, simulate_motor
from jaxmotor.prediction._packing import bucket


class Sensors(NamedTuple):
    """How controllers see their motors, one each."""

    reading: Float[Any, " motors"]
    """Where the encoder stands within a count at first, 0 to 1."""
    count_rad: Float[Any, " motors"]
    """One count [rad]; 0 where the angle is known as it is."""
    instantaneous: Bool[Any, " motors"]
    """The speed at the tick is seen, not the mean over the tick before."""


class Conditions(NamedTuple):
    """What the runs share, their initial condition included: plain numbers, or arrays of them."""

    period_s: Any
    steps: Any
    """Per tick."""
    supply_V: Any
    speed_rad_s: Any = 0.0
    angle_rad: Any = 0.0
    """Of the shaft, for laws locked to it."""
    warmth: Any = 0.0
    """The winding's relative rise of resistance."""


@program
def loops_program(
    motors: Motor,
    controllers: AbstractController,
    sensors: Sensors,
    reference: Float[Array, " n"],
    used: Int[Array, ""],
    conditions: Conditions,
) -> Arrays:
    """`simulate_loops` for a padded `reference`, of which `used` rows count."""
    ticks = jnp.arange(reference.shape[0])
    first, period = ticks == 0, conditions.period_s
    initial, warmth = (jnp.where(first, value, 0.0) for value in (conditions.speed_rad_s, conditions.warmth))
    rows = Rows(reference, first, initial, ticks.astype(reference.dtype) * period, warmth=warmth)

    def run(motor: Motor, controller: AbstractController, sensor: Sensors) -> tuple[Float[Array, " n"], ...]:
        begin, count_rad = InitialAngle(conditions.angle_rad, sensor.reading), sensor.count_rad
        done = simulate_motor(
            *(motor, rows, period, conditions.supply_V, conditions.steps, controller, count_rad, used, begin),
            instantaneous=sensor.instantaneous,
        )
        # From the tick before the first one on.
        before = jnp.stack([-conditions.speed_rad_s * period, jnp.zeros_like(period)])
        angle = jnp.concatenate([before, jnp.cumsum(done.sensed_turn)[:-1]])
        count = jnp.where(count_rad > 0, count_rad, 1.0)
        counted = jnp.where(count_rad > 0, jnp.floor(sensor.reading + angle / count) * count, angle)
        seen, exact = (jnp.diff(angles) / period for angles in (counted, angle))
        return jnp.where(sensor.instantaneous, done.sensed_speed, seen), exact, done.volts

    seen, exact, volts = jax.vmap(run)(motors, controllers, sensors)
    return {"seen": seen, "exact": exact, "volts": volts}


def simulate_loops(
    motors: Motor, controllers: AbstractController, sensors: Sensors, reference: np.ndarray, conditions: Conditions
) -> dict[str, np.ndarray]:
    """Runs of a batch of `motors` from the same `conditions`, each under one of as many `controllers`.

    `reference` (n,) is what these are asked for at each tick. Returns (batch, n): the speed that the controller sees
    (`seen`), the same without counts (`exact`) [rad/s], and what it applies (`volts`) [V]. At each tick the count is
    latched, then the voltage set, as format 1 has it.
    """
    number = len(reference)
    padded = np.concatenate([reference, np.zeros(bucket(number) - number)])
    numbers = conditions._replace(steps=np.int32(conditions.steps))
    runs = loops_program(*to_jax((motors, controllers, sensors, padded, np.int32(number), numbers)))
    return {name: np.asarray(values)[:, :number] for name, values in runs.items()}


def each(tree: Any, number: int) -> Any:
    """`tree` for `number` motors side by side."""
    return jax.tree.map(lambda leaf: np.broadcast_to(leaf, (number, *np.shape(leaf))), tree)
