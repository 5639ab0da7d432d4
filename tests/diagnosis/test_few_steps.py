"""Laws are simulated in few steps: none changes by more than a part of the noise with many."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from hidden import draw
from test_search import GAIN, PERIOD_S, POLE, noisy_log

from jaxmotor.diagnosis._found import COARSE, FINE
from jaxmotor.diagnosis._free import linear_of, together, with_each, with_effect
from jaxmotor.diagnosis._solve import Solver
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.motor.effects import EFFECTS
from jaxmotor.prediction import steps_per_row

MOST = {"backlash": 0.006}
"""Its contact has steps of its own, whatever the noise."""

pytestmark = pytest.mark.usefixtures("x64")


@pytest.fixture(scope="module")
def log():
    return noisy_log(2)


def in_steps(log, steps=None):
    study = study_of(log, POLE)
    trial = study.trial
    if steps is not None:
        trial = dataclasses.replace(trial, steps=jnp.asarray(steps, jnp.int32))
    return study, Solver(trial, noise_known=False)


def test_noisy_speeds_take_fewer_steps_than_counts_would(log):
    study, solver = in_steps(log)
    assert 2 <= int(solver.trial.steps) < steps_per_row(PERIOD_S, POLE)
    assert 2 <= int(study.quieter(1e-4).trial.steps) > int(solver.trial.steps)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_more_steps_change_chi2_by_less_than_a_law_is_known(log, name):
    study, few = in_steps(log)
    _, many = in_steps(log, 20)
    starts = EFFECTS[name].starts(rig_of(log, study.trial))[:8]
    if not starts:
        pytest.skip("this recording could not show it")
    motors = with_each(linear_of(GAIN, POLE), starts)
    speeds = np.repeat(few.starts[None], len(starts), axis=0)
    off = few.residuals(motors, speeds) - many.residuals(motors, speeds)
    assert np.isfinite(off).all() and (off**2).mean(axis=1).max() < MOST.get(name, 0.003)


@pytest.mark.usefixtures("plant_library")
@pytest.mark.parametrize(("name", "least"), [("dead_zone", 1), ("coulomb_friction", 2), ("stiction", 4)])
def test_a_fit_takes_as_few_steps_as_change_little(name, least):
    hidden = draw((name,), 5)
    solver = study_of(hidden.recording, hidden.pole).solver
    motor = with_effect(linear_of(hidden.gain, hidden.pole), EFFECTS[name].of(**hidden.truth[name]))
    for tolerance in (COARSE, FINE):
        fitted = solver.fit(motor, tolerance=tolerance)
        assert least <= fitted.steps <= solver.most
        many = Solver(dataclasses.replace(solver.trial, steps=jnp.asarray(4 * solver.most, jnp.int32)))
        [exact] = many.residuals(together([fitted.motor]), fitted.speeds[None])
        assert np.mean((exact - fitted.residual) ** 2) < 0.003
