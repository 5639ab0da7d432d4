"""Motors that share one compiled program: the effects that are neutral in it change nothing."""

import itertools

import jax
import numpy as np
import pytest
from testing.made import recording, sine, step

from jaxmotor.diagnosis._free import linear_of, together
from jaxmotor.diagnosis._shared_program import as_shared
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects import BUILT_IN, OF_LOG

GAIN, POLE = 11.0, 40.0
SHARED = sorted(name for name, effect in BUILT_IN.items() if effect.program_level is not None)
TOGETHER = [SHARED[first::4] for first in range(4)]


@pytest.fixture(scope="module")
def solver():
    made = recording(0, gain=GAIN, pole=POLE, friction=0.2, runs=[step(3.0), step(-2.0, 300), sine(1.9)])
    with jax.enable_x64(True):
        yield study_of(made, POLE).solver


def motor_with(names):
    starts = (BUILT_IN[name].start() for name in names)
    # A step in time that comes before all rows would be an offset.
    moved = (one.but(moment_s=1.0) if hasattr(one, "moment_s") else one for one in starts)
    return linear_of(GAIN, POLE, effects=tuple(moved))


def both_ways(solver, motor):
    """Its filtered residual from the shared program, and from its own."""
    assert solver.is_short
    shared = solver.residual_of(motor, solver.starts)[1]
    solver.is_short = False
    own = solver.residual_of(motor, solver.starts)[1]
    solver.is_short = True
    return shared, own


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("names", [*TOGETHER, ["coast_drive"], ["cogging", "transport_delay"]], ids="+".join)
def test_neutral_effects_change_nothing(solver, names):
    shared, own = both_ways(solver, motor_with(names))
    linear = solver.residual_of(linear_of(GAIN, POLE), solver.starts)[1]
    assert np.abs(own - linear).max() > 1
    np.testing.assert_allclose(shared, own, rtol=0, atol=1e-8)


@pytest.mark.usefixtures("x64")
def test_combinations_of_simple_effects_are_one_program():
    simple = [name for name in SHARED if BUILT_IN[name].program_level == 0]
    pairs = [as_shared(together([motor_with(names)])) for names in itertools.pairwise(simple)]
    assert len({jax.tree.structure(motors) for motors in pairs}) == 1


@pytest.mark.usefixtures("x64")
def test_what_is_the_logs_alone_stays_as_it_is():
    for own in ((), tuple(effect.start() for effect in OF_LOG[:1])):
        motors = together([linear_of(GAIN, POLE, effects=own)])
        assert as_shared(motors) is motors


@pytest.mark.usefixtures("x64")
def test_long_logs_have_programs_of_their_own():
    runs = [sine(0.7 + 0.2 * k, 8000) for k in range(6)]
    solver = study_of(recording(0, gain=GAIN, pole=POLE, runs=runs), POLE).solver
    assert not solver.is_short
