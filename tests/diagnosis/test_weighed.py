"""How sure an effect that was found is."""

import pytest

from jaxmotor.diagnosis._weighed import _may_be_none
from jaxmotor.motor.effects import EFFECTS


@pytest.mark.parametrize(
    ("name", "unknown", "may_be_none"),
    [
        ("coulomb_friction", ("volts_V",), True),
        ("coulomb_friction", (), False),
        ("cogging", ("volts_V", "cycles_per_rev"), True),
        ("winding_heating", ("time_constant_s",), False),
        ("stiction", ("static_volts_V",), False),
        ("coast_drive", (), False),
        ("current_limit", ("volts_V",), False),
    ],
)
def test_an_effect_whose_every_size_is_within_its_error_of_zero_may_be_none(name, unknown, may_be_none):
    assert _may_be_none(EFFECTS[name].start(), unknown) is may_be_none
