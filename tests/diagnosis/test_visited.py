"""The most probable of the models that were fitted."""

import dataclasses

import numpy as np
import pytest
from test_evidence import linear_fit

from jaxmotor.diagnosis._free import with_effect
from jaxmotor.diagnosis._relations import Relations
from jaxmotor.diagnosis._visited import Visited
from jaxmotor.motor.effects import LEARNED, Rig, vocabulary

RIG = Rig(5.0, (1.0, 3.0), 50.0, 0.01, 60.0, True)


def visited_with(weights):
    """Motors with the effects of each key, which have these weights."""
    linear, _, _ = linear_fit(np.random.default_rng(1))
    visited = Visited(linear, Relations(vocabulary()), RIG, np.zeros(600, int))
    visited.fitted = {}
    visited._penalties = {frozenset(names): dict.fromkeys(LEARNED.keys() & {*names}, 0.0) for names in weights}
    for names in weights:
        motor = linear.motor
        for name in names:
            motor = with_effect(motor, vocabulary()[name].start())
        visited.fitted[frozenset(names)] = dataclasses.replace(linear, template=motor)
    visited._weights = {frozenset(names): weight for names, weight in weights.items()}
    return visited


def best_of(weights):
    return visited_with(weights).best().names


@pytest.mark.usefixtures("x64")
def test_a_law_with_two_names_is_no_less_likely_for_that():
    two, curve = [("voltage_offset", "cogging"), ("load_torque", "cogging")], ("torque_over_angle",)
    assert best_of({curve: 0.4, two[0]: 0.32, two[1]: 0.28}) == two[0]
    assert best_of({curve: 0.4, two[0]: 0.28, two[1]: 0.32}) == two[1]
    assert best_of({curve: 0.7, two[0]: 0.16, two[1]: 0.14}) == curve


@pytest.mark.usefixtures("x64")
def test_laws_that_are_merely_as_good_are_not_one():
    weights = {("torque_over_speed",): 0.4, ("coulomb_friction",): 0.3, ("voltage_offset",): 0.3}
    assert best_of(weights) == ("torque_over_speed",)
    weights = {("coulomb_friction",): 0.4, ("voltage_offset",): 0.3, ("load_torque",): 0.3}
    assert best_of(weights) == ("coulomb_friction",)


@pytest.mark.usefixtures("x64")
def test_a_law_that_takes_up_no_more_than_chance_does_is_no_more_likely_for_doing_it_evenly():
    """Two per cent of the residual of 600 rows, in each block."""
    linear, _, _ = linear_fit(np.random.default_rng(1))
    price = np.exp(Relations(vocabulary()).price("voltage_offset"))

    def odds(variance: float) -> float:
        """Of the law, before its price."""
        plain = dataclasses.replace(linear, variance=variance)
        longer = dataclasses.replace(
            plain,
            template=with_effect(linear.motor, vocabulary()["voltage_offset"].start()),
            free=np.append(linear.free, 0.1),
            residual=0.99 * linear.residual,
            jacobian=np.column_stack([linear.jacobian, np.zeros(600)]),
        )
        visited = Visited(plain, Relations(vocabulary()), RIG, np.zeros(600, int))
        visited.keep([longer])
        weight = visited.weights()
        return price * weight[frozenset({"voltage_offset"})] / weight[frozenset()]

    one_row_ahead = np.exp(-600 * np.log(0.99))
    assert odds(4.0) == pytest.approx(one_row_ahead)
    assert odds(0.1) > 10 * one_row_ahead


@pytest.mark.usefixtures("x64")
def test_a_curve_that_predicts_no_better_than_a_usual_law_has_its_shape():
    relations = Relations(vocabulary())
    law, curve = ("encoder_eccentricity",), ("reading_over_angle",)
    dearer = np.exp(relations.price("encoder_eccentricity") - relations.price("reading_over_angle"))
    as_good = 0.5 * dearer
    assert visited_with({law: 0.5, curve: 0.9 * as_good}).as_law(*law, ()) == pytest.approx(0.9 * as_good)
    assert visited_with({law: 0.5, curve: 3 * as_good}).as_law(*law, ()) == pytest.approx(as_good)
    # Beside another effect it is the same; what is counted already is not counted again.
    beside = ("coulomb_friction",)
    weights = {law + beside: 0.5, curve + beside: as_good}
    assert visited_with(weights).as_law(*law, ()) == pytest.approx(as_good)
    assert visited_with(weights).as_law(*law, beside) == 0.0
    assert visited_with({law: 0.5, curve + beside: as_good}).as_law(*law, ()) == 0.0


@pytest.mark.usefixtures("x64")
def test_a_rare_law_is_no_likelier_than_another_shape():
    weights = {("cubic_drag",): 0.5, ("torque_over_speed",): 0.1}
    assert visited_with(weights).as_law("cubic_drag", ()) == 0.0
    relations = Relations(vocabulary())
    assert relations.price("cubic_drag") == relations.price("torque_over_speed")


@pytest.mark.usefixtures("x64")
def test_only_laws_over_its_coordinate_make_a_curve_dearer():
    """Friction leaves less to a curve over the speed, and so does a dead zone, of which such a curve cannot be made."""
    curve = "torque_over_speed"
    alone, friction, dead_zone = (frozenset({curve, *more}) for more in ((), ("coulomb_friction",), ("dead_zone",)))

    def dearer(**penalties: float) -> float:
        models = {"alone": alone, "friction": friction, "dead_zone": dead_zone}
        visited = visited_with({tuple(models[name]): 0.1 for name in penalties})
        visited._penalties = {models[name]: {curve: penalty} for name, penalty in penalties.items()}
        return visited._curve_price(alone)

    assert dearer(alone=9.0) == 0.0
    assert dearer(alone=9.0, dead_zone=2.0) == 0.0
    assert dearer(alone=9.0, dead_zone=2.0, friction=4.0) == 5.0
