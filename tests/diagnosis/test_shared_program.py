"""Motors that share one compiled program: the effects that are neutral in it change nothing."""

import itertools

import jax
import numpy as np
import pytest
from testing.made import recording, sine, step

from jaxmotor.diagnosis._free import linear_of, together
from jaxmotor.diagnosis._shared_program import as_shared
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects import BUILT_IN, LEARNED, OF_LOG

GAIN, POLE = 11.0, 40.0
SHARED = sorted(name for name, effect in BUILT_IN.items() if effect.program_level is not None)
TOGETHER = [SHARED[first::4] for first in range(4)]


CHEAP_ALONE = sorted(name for name, effect in BUILT_IN.items() if effect.cheap_alone)


@pytest.fixture(scope="module", params=["simple", "most"])
def solver(request):
    """Of several sequences, and of one."""
    runs = {"simple": [step(3.0), step(-2.0, 300), sine(1.9)], "most": [sine(1.9, 500)]}[request.param]
    made = recording(0, gain=GAIN, pole=POLE, friction=0.2, runs=runs)
    with jax.enable_x64(True):
        solver = study_of(made, POLE).solver
        assert solver.sharing == request.param
        yield solver


def motor_with(names):
    # A curve starts at nothing.
    term = {name: {"c2_V": 0.3} for name in LEARNED}
    term |= {"reading_over_angle": {"sin1_rad": 0.05}, "voltage_bend": {"bend_V": 0.3, "bend_share": 0.4}}
    starts = (BUILT_IN[name].start(**term.get(name, {})) for name in names)
    # A step in time that comes before all rows would be an offset.
    moved = (one.but(moment_s=1.0) if hasattr(one, "moment_s") else one for one in starts)
    return linear_of(GAIN, POLE, effects=tuple(moved))


def both_ways(solver, motor):
    """Its filtered residual from the shared program, and from its own."""
    sharing = solver.sharing
    shared = solver.residual_of(motor, solver.starts)[1]
    solver.sharing = "nothing"
    own = solver.residual_of(motor, solver.starts)[1]
    solver.sharing = sharing
    return shared, own


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize(
    "names",
    [
        *TOGETHER,
        CHEAP_ALONE,
        ["coast_drive"],
        ["cogging", "transport_delay"],
        ["torque_over_speed"],
        ["backlash"],
        ["backlash", "stiction"],
    ],
    ids="+".join,
)
def test_neutral_effects_change_nothing(solver, names):
    shared, own = both_ways(solver, motor_with(names))
    linear = solver.residual_of(linear_of(GAIN, POLE), solver.starts)[1]
    assert np.abs(own - linear).max() > 1
    np.testing.assert_allclose(shared, own, rtol=0, atol=1e-8)


@pytest.mark.usefixtures("x64")
def test_motors_side_by_side_are_what_each_is_alone(solver):
    """More than one call has: 16 at once in a log of one sequence, 8 in one of four."""
    assert solver.width == {"simple": 8, "most": 16}[solver.sharing]
    motors = [linear_of(GAIN + k, POLE, effects=motor_with(["coulomb_friction"]).effects) for k in range(20)]
    every = solver.residuals(together(motors), np.repeat(solver.starts[None], 20, axis=0))
    for k in (0, 7, 8, 15, 16, 19):
        np.testing.assert_allclose(every[k], solver.residual_of(motors[k], solver.starts)[1], rtol=0, atol=1e-9)


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("sharing", ["simple", "most"])
def test_combinations_of_simple_effects_are_one_program(sharing):
    shared = [name for name in SHARED if BUILT_IN[name].program_level == 0]
    shared += CHEAP_ALONE if sharing == "most" else []
    pairs = [as_shared(together([motor_with(names)]), sharing) for names in itertools.pairwise(shared)]
    assert len({jax.tree.structure(motors) for motors in pairs}) == 1


@pytest.mark.usefixtures("x64")
def test_curves_and_contacts_share_where_the_log_is_one_sequence():
    curves = [as_shared(together([motor_with([name])]), "most") for name in LEARNED]
    assert len({jax.tree.structure(motors) for motors in curves}) == 1
    contacts = [as_shared(together([motor_with(["backlash", name])]), "most") for name in CHEAP_ALONE]
    assert len({jax.tree.structure(motors) for motors in contacts}) == 1


@pytest.mark.usefixtures("x64")
def test_beside_a_contact_only_friction_is_shared_where_the_log_is_several():
    laws = ["backlash"], ["backlash", "stiction"], ["backlash", "coulomb_friction"]
    motors = [as_shared(together([motor_with(names)]), "simple") for names in laws]
    alone, *beside_friction = ([effect.name for effect in one.effects] for one in motors)
    assert alone == ["backlash"]
    assert beside_friction == 2 * [["backlash", "coulomb_friction", "stiction"]]


@pytest.mark.usefixtures("x64")
def test_what_is_the_logs_alone_stays_as_it_is():
    for own in ((), tuple(effect.start() for effect in OF_LOG[:1])):
        motors = together([linear_of(GAIN, POLE, effects=own)])
        assert as_shared(motors, "most") is motors


@pytest.mark.usefixtures("x64")
def test_long_logs_have_programs_of_their_own():
    runs = [sine(0.7 + 0.2 * k, 8000) for k in range(6)]
    solver = study_of(recording(0, gain=GAIN, pole=POLE, runs=runs), POLE).solver
    assert solver.sharing == "nothing"
