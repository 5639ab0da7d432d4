"""Friction exact over a tick, against the general simulation in many steps."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.fleet import simulate_friction
from jaxmotor.fleet._friction_simulation import _log
from jaxmotor.motor import FirstOrder, Motor, Rows, simulate_motor
from jaxmotor.motor.effects import CoulombFriction, DeadZone


def volts_of(seed):
    rng = np.random.default_rng(seed)
    return np.concatenate([4 * np.sin(np.cumsum(rng.uniform(0.0, 0.2, 300))), np.repeat(rng.normal(0, 1, 30), 8)])


def both(parameters, volts, steps):
    gain, pole, friction, dead = parameters
    reset = np.zeros(volts.shape, bool)
    reset[0] = reset[300] = True
    start = np.where(reset, 7.0, 0.0) * (np.arange(len(volts)) > 0)
    motor, period = FirstOrder(gain, pole), jnp.asarray(0.005)
    exact = simulate_friction(motor, friction, dead, *(jnp.asarray(x)[:, None] for x in (volts, reset, start)), period)
    whole = Motor(motor, (CoulombFriction(friction), DeadZone(dead)), jnp.zeros(()))
    rows = Rows(jnp.asarray(volts), jnp.asarray(reset), jnp.asarray(start), jnp.zeros(len(volts)))
    stepped = simulate_motor(whole, rows, period, jnp.asarray(7.4), steps)
    return exact, stepped


@pytest.mark.parametrize("friction", [0.0, 0.3, 1.5])
def test_the_general_simulation_comes_near_with_more_steps(friction, x64):
    parameters = [jnp.asarray(x) for x in (11.0, 40.0, friction, 0.2)]
    apart = []
    for steps in (10, 100, 1000):
        exact, stepped = both(parameters, volts_of(1), steps)
        apart.append(float(jnp.abs(exact.turn[:, 0] - stepped.turn).max()) / float(jnp.abs(stepped.turn).max()))
    assert apart[2] < 1e-5
    if friction:
        assert apart[2] < apart[1] < apart[0]


def test_derivatives_are_those_of_differences(x64):
    volts = volts_of(2)[:, None]
    reset, still = jnp.zeros(volts.shape, bool).at[0, 0].set(True), jnp.zeros(volts.shape)

    def position(parameters):
        gain, pole, friction, dead = parameters
        motion = simulate_friction(
            FirstOrder(gain, pole), friction, dead, jnp.asarray(volts), reset, still, jnp.asarray(0.005)
        )
        return jnp.cumsum(motion.turn[:, 0])

    at = jnp.asarray([11.0, 40.0, 0.3, 0.1])
    jacobian = jax.jacfwd(position)(at)
    assert np.isfinite(jacobian).all()
    for k in range(4):
        step = jnp.zeros(4).at[k].set(1e-6 * at[k])
        difference = (position(at + step) - position(at - step)) / (2 * step[k])
        np.testing.assert_allclose(jacobian[:, k], difference, atol=2e-4 * float(jnp.abs(difference).max()))


@pytest.mark.parametrize(("dtype", "atol"), [(np.float64, 2e-15), (np.float32, 1e-6)])
def test_the_logarithm_is_one(dtype, atol, x64):
    y = np.concatenate([1 + np.geomspace(1e-7, 1, 200), np.geomspace(1, 1e6, 200)]).astype(dtype)
    np.testing.assert_allclose(_log(jnp.asarray(y)), np.log(y), rtol=4 * np.finfo(dtype).eps, atol=atol)
