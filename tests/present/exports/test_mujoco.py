"""The motor as MuJoCo loads and simulates it."""

import dataclasses

import numpy as np
import pytest
from cases import VOLTS, made, simulated

from jaxmotor import JaxmotorError
from jaxmotor.control import slow_pole
from jaxmotor.motor import linear_motor
from jaxmotor.present.exports import to_mujoco

FRICTION = ("coulomb_friction", {"volts_V": 0.3})


@pytest.fixture
def mujoco():
    return pytest.importorskip("mujoco", reason="MuJoCo is not installed; pip install mujoco")


def run(mujoco, text, volts, period_s=0.005):
    """Speed at each tick."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    steps = round(period_s / model.opt.timestep)
    model.opt.timestep = period_s / steps
    speed = []
    for u in volts:
        speed.append(data.sensor("speed").data[0] if data.time else 0.0)
        data.ctrl[0] = u
        for _ in range(steps):
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
    return np.array(speed)


@pytest.mark.parametrize(
    ("effects", "offset", "limit"),
    [((), 0.0, 0.012), ((FRICTION,), 0.0, 0.015), ((FRICTION,), 0.2, 0.015)],
    ids=["linear", "friction", "friction and offset"],
)
def test_it_simulates_as_we_do(mujoco, effects, offset, limit):
    """MuJoCo's integrator takes ten steps in the time constant or more; that is its precision, 1.2 % of the speed."""
    model = made(*effects, offset=offset)
    speed, _ = simulated(model, VOLTS)
    found = run(mujoco, to_mujoco(model, supply_V=7.4), VOLTS)
    assert np.sqrt(np.mean((found - speed) ** 2)) < limit * np.sqrt(np.mean(speed**2))


def test_finer_steps_come_nearer(mujoco):
    model = made(FRICTION)
    speed, _ = simulated(model, VOLTS)
    text = to_mujoco(model)
    finer = text.replace('timestep="0.001"', 'timestep="0.0001"').replace(
        'solreffriction="0.002 1"', 'solreffriction="0.0002 1"'
    )
    assert finer != text
    errors = [np.abs(run(mujoco, one, VOLTS) - speed).max() for one in (text, finer)]
    assert errors[1] < 0.25 * errors[0]


def test_friction_holds_at_rest(mujoco):
    held = run(mujoco, to_mujoco(made(FRICTION)), np.full(200, 0.28))
    assert np.abs(held).max() < 0.02
    assert run(mujoco, to_mujoco(made(FRICTION)), np.full(200, 0.4))[-1] == pytest.approx(10.6 * 0.1, rel=0.02)


def test_any_inertia_gives_the_same_motion(mujoco):
    runs = [run(mujoco, to_mujoco(made(FRICTION), inertia_kgm2=j), VOLTS) for j in (1e-6, 3e-3)]
    np.testing.assert_allclose(*runs, atol=2e-3)


@pytest.mark.parametrize("effects", [(), (FRICTION,)], ids=["linear", "friction"])
@pytest.mark.parametrize("lag", [2e-5, 1.2e-4, 1e-3, 4e-3, 6e-3])
def test_a_short_electrical_lag_needs_no_short_steps(mujoco, lag, effects):
    """1 % of the speed at steps of 1 ms, be the lag longer or far shorter."""
    model = made(*effects, lag=lag)
    text = to_mujoco(model)
    assert mujoco.MjModel.from_xml_string(text).opt.timestep == 1e-3
    speed, _ = simulated(model, VOLTS)
    assert np.sqrt(np.mean((run(mujoco, text, VOLTS) - speed) ** 2)) < 0.01 * np.sqrt(np.mean(speed**2))


@pytest.mark.parametrize("lag", [None, 1e-3])
def test_a_fast_motor_has_ten_steps_in_its_time_constant(mujoco, lag):
    model = made(lag=lag)
    values = [10.6, 200.0] if lag is None else [10.6, 200.0, lag]
    fast = dataclasses.replace(model, motor=linear_motor(values))
    text = to_mujoco(fast)
    slow = slow_pole(fast.whole)
    assert mujoco.MjModel.from_xml_string(text).opt.timestep == pytest.approx(0.1 / slow)
    speed, _ = simulated(fast, VOLTS)
    assert np.sqrt(np.mean((run(mujoco, text, VOLTS) - speed) ** 2)) < 0.02 * np.sqrt(np.mean(speed**2))


def test_an_electrical_lag_is_the_faster_pole(mujoco):
    model = made(lag=0.004)
    speed, _ = simulated(model, VOLTS)
    found = run(mujoco, to_mujoco(model), VOLTS)
    plain = run(mujoco, to_mujoco(made()), VOLTS)
    errors = [np.sqrt(np.mean((one - speed) ** 2)) for one in (found, plain)]
    assert errors[0] < 0.25 * errors[1] and errors[0] < 0.02 * np.sqrt(np.mean(speed**2))


def test_the_control_is_limited_to_the_supply(mujoco):
    assert run(mujoco, to_mujoco(made(), supply_V=5.0), np.full(200, 9.0))[-1] == pytest.approx(53.0, rel=1e-3)


def test_what_it_cannot_carry_and_what_it_guesses_is_said(mujoco):
    text = to_mujoco(made(("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3}), recording="--> <evil/>"))
    assert "Not carried: backlash" in text and "is a guess" in text and "<evil" not in text
    mujoco.MjModel.from_xml_string(text)
    with pytest.raises(JaxmotorError, match="not positive"):
        to_mujoco(made(), inertia_kgm2=-1.0)
