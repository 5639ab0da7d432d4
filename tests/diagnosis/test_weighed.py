"""How sure an effect that was found is."""

from types import SimpleNamespace

import pytest

from jaxmotor.diagnosis._explain import _is_idle
from jaxmotor.diagnosis._found import Found, Named
from jaxmotor.diagnosis._found_effect import Alternative
from jaxmotor.diagnosis._held_out import HeldOut
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study
from jaxmotor.diagnosis._weighed import _may_be_none, _overtaken_by, _sureness
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


@pytest.mark.parametrize(
    ("chi2", "before", "after", "without", "known", "own", "is_idle"),
    [
        (1.02, 0.68, 0.70, 0.68, False, True, True),
        (1.02, 0.68, 0.70, 0.72, False, True, False),  # one of the effects helps
        (1.02, 0.70, 0.68, 0.66, False, True, False),  # together they help
        (1.60, 0.68, 0.70, 0.68, False, True, False),  # the linear motor leaves something
        (1.02, 1.60, 1.70, 1.60, False, True, False),  # of rows held out
        (1.02, 0.68, 0.70, 0.68, True, True, False),  # no more than a known noise is seen exactly
        (1.02, 0.68, 0.70, 0.68, False, False, False),  # nothing was held out
    ],
)
def test_effects_that_take_up_nothing_are_idle(chi2, before, after, without, known, own, is_idle):
    names = ("coulomb_friction", "cogging")
    held = only(
        HeldOut,
        own=own,
        before=SimpleNamespace(drift=before),
        after=SimpleNamespace(drift=after),
        fitted=SimpleNamespace(names=names),
        shorter={"coulomb_friction": without, "cogging": before},
    )
    study = only(Study, packed=SimpleNamespace(observation=SimpleNamespace(floor_known=known)))
    found = only(Found, linear=SimpleNamespace(chi2=chi2), named=tuple(only(Named, name=name) for name in names))
    assert _is_idle(study, found, held) is is_idle


@pytest.mark.parametrize(("is_likeliest", "family"), [(True, 0.97), (False, 0.06)])
def test_equals_of_other_families_are_of_the_likeliest_one(is_likeliest, family):
    """One step that a load, cogging and six others explain as well is no difference between the directions."""
    named = only(Named, probability=0.06, with_equal=0.97, with_law=0.9, unexplained_share=0.0, held_out_share=0.0)
    named = only(Named, **vars(named), name="load_torque")
    assert _sureness(named, 0.06, is_likeliest)[3] == pytest.approx(family)
