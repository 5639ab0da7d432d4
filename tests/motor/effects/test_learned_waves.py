"""A learned curve over the angle can be the wave of a known law, from which a fit in its place begins."""

import jax.numpy as jnp
import numpy as np
import pytest
from effect_cases import SIZES

from jaxmotor.motor.effects import EFFECTS, LEARNED

pytestmark = pytest.mark.usefixtures("x64")


@pytest.mark.parametrize(
    ("law", "curve"), [("cogging", "torque_over_angle"), ("encoder_eccentricity", "reading_over_angle")]
)
def test_it_is_the_wave_that_it_contains(law, curve):
    angle, wave, none = jnp.linspace(0.0, 7.0, 50), EFFECTS[law].of(**SIZES[law]), LEARNED[curve].start()
    assert LEARNED[curve].contains == (law,)
    own = -wave.resists(angle, angle) if law == "cogging" else wave.error(angle)
    np.testing.assert_allclose(none.like(wave).adds(angle), own, atol=1e-9)
    assert none.like(wave.but(cycles_per_rev=13.0)) is none


def test_other_curves_and_laws_are_left_as_they_are():
    curve = LEARNED["voltage_over_command"].start(reach_V=6.0)
    assert curve.like(EFFECTS["dead_zone"].of(volts_V=0.3)) is curve
    assert LEARNED["torque_over_angle"].start().like(EFFECTS["coulomb_friction"].of(volts_V=0.3)).series[0] == 0.0
