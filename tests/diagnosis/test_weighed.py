"""How sure an effect that was found is."""

from types import SimpleNamespace

import pytest

from jaxmotor.diagnosis._found import Found, Named
from jaxmotor.diagnosis._found_effect import Alternative
from jaxmotor.diagnosis._held_out import HeldOut
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._weighed import _may_be_none, _overtaken_by
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


def only(kind, **fields):
    """Of a dataclass, these fields alone."""
    one = object.__new__(kind)
    for name, value in fields.items():
        object.__setattr__(one, name, value)
    return one


@pytest.mark.parametrize(
    ("drift", "excess", "own", "alike", "instead"),
    [
        (5.6, -3.7, True, False, "quadratic_drag"),
        (5.6, -2.0, True, False, None),  # not far better
        (5.6, -3.7, True, True, None),  # told with it
        (5.6, -3.7, False, False, None),  # nothing was held out
        (1.1, -0.9, True, False, None),  # both leave no more than noise
    ],
)
def test_an_effect_is_overtaken_by_what_predicts_held_out_rows_far_better(drift, excess, own, alike, instead):
    held = only(HeldOut, own=own, after=SimpleNamespace(drift=drift))
    motors = [
        only(Fitted, template=SimpleNamespace(effects=(EFFECTS["coulomb_friction"].start(), EFFECTS[name].start())))
        for name in ("backlash", "quadratic_drag")
    ]
    fitted = only(Fitted, template=SimpleNamespace(effects=(EFFECTS["coulomb_friction"].start(),)))
    found, named = only(Found, fitted=fitted), only(Named, name="cogging", alternatives=tuple(motors))
    others = (Alternative("quadratic_drag", excess, alike), Alternative("backlash", 1.0, False))
    effect = _overtaken_by(held, found, named, others)
    assert (None if effect is None else effect.name) == instead
