"""What holds for every effect, whatever its law."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_cases import (
    LAGLESS,
    PERIOD,
    SIZES,
    SUPPLY,
    angle_of,
    fast_turned,
    jacobian,
    linear,
    motor,
    number,
    plan,
    rows,
    turned,
    values,
    volts,
    with_values,
)

from jaxmotor.motor import simulate
from jaxmotor.motor._motor import Motor
from jaxmotor.motor.effects import EFFECTS, parameters
from jaxmotor.text import law

pytestmark = pytest.mark.usefixtures("x64")
NAMES = sorted(EFFECTS)
# An event moves with the parameter, so that the derivative is that of a wide difference only.
WIDE = {"backlash": (0.02, 0.2), "missed_counts": (1e-3, 0.02)}
STEP_AND_TOLERANCE = (1e-6, 2e-4)
STAIRCASE = {"input_threshold"}
# Their neutral value is far away; and where friction first stops a motor it does more than in proportion.
NOWHERE_NEAR = {"coast_drive", "current_limit", "voltage_saturation"}
SMALL = {"coulomb_friction": 0.03, "stiction": 0.15, "sector_friction": 0.03, "warming_friction": 0.03}
DIRECTED = {"voltage_offset", "direction_asymmetry", "load_torque"}
LOCKED = {
    "cogging": {"phase_rad": 0.0},
    "encoder_eccentricity": {"phase_rad": 0.0},
    "sector_friction": {"centre_rad": 0.0},
}
"""To the angle, and where they are alike in both directions."""


def given(name, sign=1.0):
    """Voltages, and an angle for laws that are locked to it."""
    driven = sign * volts(plan())
    return rows(driven, sign * angle_of(sign * driven) if name in LOCKED else None)


@pytest.mark.parametrize("name", NAMES)
def test_neutral_is_the_linear_motor(name):
    own = linear(name in LAGLESS)
    neutral = Motor(own, (EFFECTS[name].neutral(),), number(0.045))
    driven = given(name)
    if name == "coast_drive":  # has no size; at full duty the winding is never disconnected
        driven = driven._replace(volts=jnp.where(driven.volts >= 0, SUPPLY, -SUPPLY))
    # With a lag β matters by itself, a few per mille of τ.
    neutral = neutral if name in LAGLESS else Motor(own, neutral.effects, number(0.0))
    expected = simulate(own, driven.volts, driven.reset, driven.initial_speed, number(PERIOD)).turn
    tolerance = 2e-6 if name == "coast_drive" else 1e-9
    np.testing.assert_allclose(fast_turned(neutral, driven), expected, atol=tolerance)


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_are_differences(name):
    at, driven = motor(name), given(name)
    where = values(at)
    found = np.asarray(jacobian(at, driven))
    step, tolerance = WIDE.get(name, STEP_AND_TOLERANCE)
    assert np.isfinite(found).all()
    for k in range(len(where)):
        shift = jnp.zeros_like(where).at[k].set(step * jnp.maximum(where[k], 1e-6))
        ends = [fast_turned(with_values(at, where + sign * shift), driven) for sign in (1, -1)]
        expected = np.asarray(ends[0] - ends[1]) / (2 * float(shift[k]))
        if name in STAIRCASE and k == len(where) - 2:
            assert not found[:, k].any()
            continue
        error = np.linalg.norm(found[:, k] - expected)
        assert error <= tolerance * max(np.linalg.norm(expected), 1e-9 / float(shift[k])), (k, error)


@pytest.mark.parametrize("name", NAMES)
def test_compiled_is_eager_and_a_batch_is_a_loop(name):
    at, driven = motor(name), given(name)
    batch = values(at)[None] * number([0.9, 1.0, 1.1])[:, None]
    together = jax.vmap(lambda x: turned(with_values(at, x), driven))(batch)
    for row, found in zip(batch, together, strict=True):
        np.testing.assert_allclose(found, fast_turned(with_values(at, row), driven), atol=1e-11)


@pytest.mark.parametrize("name", NAMES)
def test_gradient_at_rest_is_finite(name):
    at, driven = motor(name), given(name)
    still = driven._replace(volts=jnp.zeros_like(driven.volts))
    assert np.isfinite(jacobian(at, still)).all()
    neutral = Motor(at.linear, (EFFECTS[name].neutral(),), at.viscous_share)
    assert np.isfinite(jacobian(neutral, still)).all()
    assert np.isfinite(jacobian(neutral, driven)).all()


@pytest.mark.parametrize("name", sorted(set(NAMES) - DIRECTED))
def test_both_directions_are_alike(name):
    at = motor(name, **LOCKED.get(name, {}))
    forwards, backwards = fast_turned(at, given(name)), fast_turned(at, given(name, -1.0))
    np.testing.assert_allclose(backwards, -forwards, atol=1e-11)


@pytest.mark.parametrize("name", sorted(set(NAMES) - NOWHERE_NEAR - STAIRCASE))
def test_derivative_at_the_neutral_value_is_that_of_a_small_effect(name):
    """What a score test sees of an effect that is not in the model yet."""
    given_to = given(name)
    at = motor(name)
    sizes = SIZES[name] | {key: 0.0 for key, about in parameters(EFFECTS[name]).items() if about["neutral"] == 0.0}
    at = Motor(at.linear, (EFFECTS[name].of(**sizes),), at.viscous_share)
    found, where, first = np.asarray(jacobian(at, given_to)), values(at), len(jax.tree.leaves(at.linear))
    for k, key in enumerate(SIZES[name], first):
        step = 1e-3 * SIZES[name][key]
        moved = fast_turned(with_values(at, where.at[k].add(step)), given_to) - fast_turned(at, given_to)
        expected = np.asarray(moved) / step
        error = np.linalg.norm(found[:, k] - expected)
        assert error <= SMALL.get(name, 0.01) * np.linalg.norm(expected), key


@pytest.mark.parametrize("name", NAMES)
def test_effect_shows(name):
    """At hobby size it moves the reading by more than half a count somewhere."""
    with_it, driven = motor(name), given(name)
    plain = Motor(linear(name in LAGLESS), (), with_it.viscous_share)
    moved = fast_turned(with_it, driven) - fast_turned(plain, driven)
    assert np.abs(np.cumsum(moved)).max() > np.pi / 617


def test_every_effect_has_a_size():
    assert set(SIZES) == set(EFFECTS)


def test_a_negative_size_is_told_by_its_sentence():
    falls, rises = (law(EFFECTS["supply_drift"].of(rate_per_s=sign * 2e-4), {}) for sign in (1, -1))
    assert falls == "the supply falls by 1.2 % per minute" and rises == "the supply rises by 1.2 % per minute"
    told = {name: effect.start() for name, effect in EFFECTS.items() if effect.says_negative}
    for name, effect in told.items():
        signed = [key for key, about in parameters(effect).items() if about["kind"] == "signed"]
        size = abs(float(getattr(effect, signed[0])))
        positive, negative = (law(effect.but(**{signed[0]: sign * size}), {}) for sign in (1, -1))
        assert len(signed) == 1 and positive != negative and "-" not in negative, name
