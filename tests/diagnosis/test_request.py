"""Which effects a diagnosis may name, and what it tells of its work."""

import threading
import time

import jax
import pytest
from diagnosed import MADE, of

from jaxmotor import JaxmotorError, diagnose
from jaxmotor.diagnosis._request import Request
from jaxmotor.motor.effects import EFFECTS, vocabulary

LEFT = {"dead_zone", "transport_delay", "voltage_saturation", "quadratic_drag", "sensor_lag"}


@pytest.fixture(scope="module")
def without_friction():
    told = []
    found = diagnose(MADE["friction"](), exclude=set(EFFECTS) - LEFT, on_progress=told.append)
    return found, told


def test_what_is_excluded_is_not_named(without_friction):
    named = {
        name for one in without_friction[0].effects for name in (one.name, *(other.name for other in one.alternatives))
    }
    assert not named & {"coulomb_friction", "stiction"}
    assert [one.name for one in of("friction")[1].effects] == ["coulomb_friction"]


def test_the_work_is_told_from_begin_to_end(without_friction):
    told = without_friction[1]
    assert told[0] == ("linear fit", 0, 4) and told[-1].stage == "open hypotheses"
    done = [one.done for one in told]
    assert set(done) == {0, 1, 2, 3} and all(0 <= one < 4 for one in done)
    tried = {one.stage.removeprefix("effects: ") for one in told if one.done == 1}
    assert {"dead_zone", "transport_delay"} <= tried and "coulomb_friction" not in tried


@pytest.mark.parametrize("made", ["friction", "clean"])
def test_without_any_effect_a_linear_motor_is_left(made):
    found = diagnose(MADE[made](), effects=[])
    assert found.effects == () and found.verdict == ("complete" if made == "clean" else "unexplained")


@pytest.mark.parametrize("when", ["linear fit", "effects: "])
def test_who_stops_it_finds_nothing_left(when, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = {thread.name for thread in threading.enumerate()}

    def stop(now):
        if now.stage.startswith(when):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diagnose(MADE["friction"](), on_progress=stop)
    assert not jax.config.jax_enable_x64 and not list(tmp_path.iterdir())
    deadline = time.monotonic() + 60
    while {thread.name for thread in threading.enumerate()} - before and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not {thread.name for thread in threading.enumerate()} - before


def test_names_are_those_of_the_vocabulary():
    assert Request().effects == frozenset(vocabulary()) and "timing_offset" not in vocabulary()
    assert Request("stiction").effects == {"stiction"}
    assert Request(["stiction", "backlash"], "backlash").effects == {"stiction"}
    with pytest.raises(JaxmotorError, match=r"the effect is 'frition', which is not known; .*friction"):
        Request(exclude=["frition"])
