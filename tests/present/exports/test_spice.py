"""The motor as ngspice loads and simulates it."""

import dataclasses
import shutil
import subprocess

import numpy as np
import pytest
from cases import VOLTS, made, simulated

from jaxmotor import JaxmotorError
from jaxmotor.present.exports import to_spice

FRICTION = ("coulomb_friction", {"volts_V": 0.3})
PERIOD = 0.005
EDGE = 1e-7
"""In which the source changes [s]."""


@pytest.fixture
def ngspice(tmp_path):
    program = shutil.which("ngspice")
    if program is None:
        pytest.skip("ngspice is not installed; apt install ngspice")

    def run(text, volts, load="", longest=PERIOD / 50):
        """Speed and angle at each tick, and the winding's current."""
        (tmp_path / "motor.lib").write_text(text)
        ticks = np.arange(len(volts)) * PERIOD
        points = [
            f"{time + late:.9g} {value:.9g}"
            for time, one, two in zip(ticks, [0.0, *volts], volts, strict=False)
            for late, value in ((0.0, one), (EDGE, two))
        ]
        end = len(volts) * PERIOD
        net = ["title", ".include motor.lib", "Vs p 0 pwl(", *(f"+ {point}" for point in points), "+ )"]
        net += ["X1 p 0 speed angle motor", load, ".options reltol=1e-5", f".tran {longest} {end:.9g} 0 {longest} uic"]
        net += [".control", "run", "wrdata out.txt v(speed) v(angle) i(vs)", ".endc", ".end"]
        (tmp_path / "net.cir").write_text("\n".join(net) + "\n")
        command = [program, "-b", "net.cir"]
        done = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
        assert (tmp_path / "out.txt").exists(), done.stdout + done.stderr
        time, speed, _, angle, _, current = np.loadtxt(tmp_path / "out.txt").T
        late = ticks + PERIOD - 1e-6
        return tuple(np.interp(late, time, column) for column in (speed, angle, -current))

    return run


CASES = {
    "linear": made(),
    "friction": made(FRICTION),
    "friction and offset": made(FRICTION, offset=0.2),
    "L/R": made(FRICTION, lag=0.004),
    "viscous": dataclasses.replace(made(FRICTION, lag=0.004), viscous_share=0.3),
    "drag and load": made(("quadratic_drag", {"volts_V_s2_rad2": 5e-4}), ("load_torque", {"volts_V": -0.4})),
    "turned round": made(FRICTION, ("load_torque", {"volts_V": 0.3}), gain=-10.6),
}


@pytest.mark.parametrize("case", CASES)
def test_it_simulates_as_we_do(ngspice, case):
    model = CASES[case]
    speed, turn = simulated(model, [*VOLTS, 0.0])
    found, angle, _ = ngspice(to_spice(model), VOLTS)
    assert np.sqrt(np.mean((found - speed[1:]) ** 2)) < 1e-4 * np.sqrt(np.mean(speed**2))
    np.testing.assert_allclose(angle, np.cumsum(turn)[:-1], atol=2e-3 * np.ptp(np.cumsum(turn)))


def test_friction_holds_at_rest(ngspice):
    model = made(FRICTION)
    speed, _, _ = ngspice(to_spice(model), np.full(200, 0.2))
    assert np.abs(speed).max() < 1e-3 * 10.6
    assert ngspice(to_spice(model), np.full(200, 0.4))[0][-1] == pytest.approx(10.6 * 0.1, rel=0.01)


def test_any_resistance_gives_the_same_motion_and_its_own_current(ngspice):
    runs = [ngspice(to_spice(made(FRICTION), resistance_ohm=ohm), VOLTS) for ohm in (0.5, 20.0)]
    np.testing.assert_allclose(runs[0][0], runs[1][0], atol=0.02)
    np.testing.assert_allclose(runs[0][2] * 0.5, runs[1][2] * 20.0, atol=0.01)
    np.testing.assert_allclose(runs[0][2], (VOLTS - runs[0][0] / 10.6) / 0.5, atol=0.01)


def test_a_load_is_a_capacitor_and_a_current(ngspice):
    """As much inertia again halves the pole; a torque of half the stall's takes half the speed."""
    k, ohm, gain, pole = 1 / 10.6, 2.0, 10.6, 40.0
    inertia = k / (ohm * gain * pole)
    speed, _, _ = ngspice(to_spice(made(), resistance_ohm=ohm), np.full(100, 5.0), f"Cload speed 0 {inertia} ic=0")
    ticks = np.arange(1, 101) * PERIOD
    np.testing.assert_allclose(speed, 53.0 * (1 - np.exp(-pole / 2 * ticks)), atol=0.02)
    speed, _, _ = ngspice(
        to_spice(made(), resistance_ohm=ohm), np.full(100, 5.0), f"Iload speed 0 {0.5 * k * 5.0 / ohm}"
    )
    assert speed[-1] == pytest.approx(26.5, rel=1e-3)


def test_what_it_cannot_carry_and_what_it_guesses_is_said(ngspice):
    backlash = ("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3})
    text = to_spice(made(backlash, FRICTION, recording="x\n.shell reboot"))
    assert "* Not carried: backlash" in text and "is a guess" in text and "\n.shell" not in text
    ngspice(text, VOLTS[:5])
    assert "is a guess" not in to_spice(made(), resistance_ohm=3.2)
    with pytest.raises(JaxmotorError, match="not positive"):
        to_spice(made(), resistance_ohm=0.0)
