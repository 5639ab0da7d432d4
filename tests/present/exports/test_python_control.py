"""The motor as python-control loads and simulates it."""

import builtins

import numpy as np
import pytest
from cases import HARDWARE, VOLTS, made, simulated

from jaxmotor import JaxmotorError
from jaxmotor.present.exports import to_control, to_python


@pytest.fixture
def control():
    return pytest.importorskip("control", reason="python-control is not installed; pip install control")


def loaded(text):
    scope = {}
    exec(compile(text, "motor.py", "exec"), scope)
    return scope


@pytest.mark.parametrize("lag", [None, 0.004])
def test_it_simulates_as_we_do(control, lag):
    model = made(lag=lag)
    speed, turn = simulated(model, VOLTS)
    found = to_control(model, HARDWARE.__class__(0.005, 617.4, 7.4))
    _, seen = control.forced_response(found.sampled, np.arange(len(VOLTS)) * 0.005, VOLTS)
    np.testing.assert_allclose(seen[1:], turn[:-1] / 0.005, atol=1e-9)
    held = np.repeat(VOLTS, 50)
    _, fine = control.forced_response(control.c2d(found.transfer, 1e-4), np.arange(len(held)) * 1e-4, held)
    np.testing.assert_allclose(fine[::50], speed, atol=1e-8)
    np.testing.assert_allclose(*(sorted(control.poles(g).real) for g in (found.state_space, found.transfer)))


def test_the_file_builds_the_same_objects(control):
    model = made(("coulomb_friction", {"volts_V": 0.3}), lag=0.002, offset=0.02, response=True)
    found, scope = to_control(model, HARDWARE), loaded(to_python(model, HARDWARE))
    w = np.array([1.0, 30.0, 200.0])
    for name in ("transfer", "state_space", "sampled"):
        np.testing.assert_array_equal(scope[name](1j * w), getattr(found, name)(1j * w))
    np.testing.assert_array_equal(scope["response"].frdata, found.response.frdata)
    np.testing.assert_array_equal(scope["response_covariance"], model.response.covariance)
    np.testing.assert_array_equal(scope["covariance"], model.covariance)
    assert scope["voltage_offset_V"] == 0.02 and scope["response"].omega == pytest.approx(
        2 * np.pi * np.array([1, 3, 7])
    )


def test_a_delay_is_in_the_sampled_motor(control):
    model = made(("transport_delay", {"delay_s": 0.0085}))
    _, turn = simulated(model, VOLTS)
    found = to_control(model)
    _, seen = control.forced_response(found.sampled, np.arange(len(VOLTS)) * 0.005, VOLTS)
    np.testing.assert_allclose(seen[1:], turn[:-1] / 0.005, atol=1e-9)
    assert "# Not carried: transport_delay: in `sampled` only" in to_python(model)


def test_what_a_transfer_function_cannot_carry_is_said():
    text = to_python(made(("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3}), ("dead_zone", {"volts_V": 0.2})))
    assert "# Not carried: backlash:" in text and "# Not carried: dead_zone:" in text


@pytest.mark.parametrize("name", ['"""\nimport os; os.abort()\n"""', "\\", "x\r\nraise SystemExit", "é\u202e", '"' * 9])
def test_a_hostile_name_is_text(control, name):
    scope = loaded(to_python(made(recording=name)))
    assert scope["gain_rad_s_V"] == 10.6 and "os" not in scope


def test_without_python_control_it_is_a_sentence(monkeypatch):
    real = builtins.__import__

    def no_control(name, *rest):
        if name == "control":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", no_control)
    with pytest.raises(JaxmotorError, match="pip install control"):
        to_control(made())
