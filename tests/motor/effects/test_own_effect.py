"""An effect of one's own: named among the built-in ones, kept, exported, reported; and what is wrong with a class."""

import json
import sys
from typing import ClassVar

import equinox as eqx
import jax
import numpy as np
import pytest
from steep_drag import SteepDrag

import jaxmotor as jm
from jaxmotor._programs import program
from jaxmotor.cli import main
from jaxmotor.control import Hardware
from jaxmotor.diagnosis._relations import Relations, excluded
from jaxmotor.diagnosis._request import Request
from jaxmotor.estimate import model_to_json
from jaxmotor.motor.effects import (
    AbstractEffect,
    AbstractLoadEffect,
    AbstractMotionEffect,
    AbstractTorqueEffect,
    LogFilter,
    TimingOffset,
    known_effect,
    parameter,
    vocabulary,
)
from jaxmotor.present import causes
from jaxmotor.present.exports import design, to_c, to_python

GAIN, POLE, DRAG_V = 10.0, 40.0, 1.25
"""[rad/s/V], [rad/s], and at 50 rad/s [V]."""
PERIOD_S, FINE = 0.005, 50


def made(seed):
    """w' = a (K (u - v (w/50)⁵) - w) by the midpoint rule in steps of 0.1 ms, read by an encoder: eight runs from rest.

    Of that shape are the other recordings that the tests diagnose, too: their compiled programs serve here as well.
    """
    rng, angle, step = np.random.default_rng(seed), 0.0, PERIOD_S / FINE
    volts = [np.repeat(rng.uniform(-6, 6, 20), 25) for _ in range(8)]
    counts = []
    for applied in volts:
        speed, angles = 0.0, []
        for u in applied:
            angles.append(angle)
            for _ in range(FINE):
                middle = speed + 0.5 * step * POLE * (GAIN * (u - DRAG_V * (speed / 50) ** 5) - speed)
                speed += step * POLE * (GAIN * (u - DRAG_V * (middle / 50) ** 5) - middle)
                angle += step * middle
        counts.append(np.floor(np.array(angles) * 617.4 / (2 * np.pi)).astype(int))
    time_s = [PERIOD_S * np.arange(len(applied)) + 3.0 * number for number, applied in enumerate(volts)]
    return jm.from_arrays(
        time_s=time_s, volts=volts, counts=counts, counts_per_rev=617.4, at_rest=True, name="own", supply_V=6.0
    )


@pytest.fixture(scope="module")
def recording():
    return made(1)


@pytest.fixture(scope="module")
def diagnosis(recording):
    return jm.diagnose(recording, effects=[*jm.EFFECTS, SteepDrag])


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A function that installs a package with an entry point: what `pip` leaves of one."""

    def install(value, package="own-drag"):
        folder = tmp_path / f"{package.replace('-', '_')}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (folder / "entry_points.txt").write_text(f"[jaxmotor.effects]\nown = {value}\n")
        monkeypatch.syspath_prepend(tmp_path)
        vocabulary.cache_clear()

    yield install
    monkeypatch.undo()
    vocabulary.cache_clear()


def test_it_is_named_among_all_with_its_size(diagnosis):
    [found] = diagnosis.effects
    assert found.name == "steep_drag" and diagnosis.verdict == "extended" and found.probability > 0.99
    assert abs(found.parameters["volts_V"] - DRAG_V) < 3 * found.standard_error["volts_V"] < 0.01
    assert abs(float(diagnosis.motor.linear.gain) - GAIN) < 3 * diagnosis.standard_error["gain_rad_s_V"]
    assert {one.name for one in found.alternatives} & {"quadratic_drag"}
    assert diagnosis.held_out.after.chi2_per_sample < 1.1 < 2 < diagnosis.held_out.before.chi2_per_sample
    assert causes(diagnosis).axes and "Steep drag" in repr(diagnosis).replace("steep_drag", "Steep drag")


def test_classes_and_names_may_be_mixed():
    assert Request(SteepDrag).effects == {"steep_drag"}
    assert Request([SteepDrag, "stiction"]).effects == {"steep_drag", "stiction"}
    assert Request([SteepDrag, "stiction"], exclude=[SteepDrag]).effects == {"stiction"}
    assert Request(exclude=SteepDrag).effects == set(vocabulary())
    assert Request([jm.EFFECTS["stiction"]]).effects == {"stiction"}


def test_where_it_is_registered_its_model_is_kept(diagnosis, installed, tmp_path):
    installed("steep_drag:SteepDrag")
    assert vocabulary()["steep_drag"] is SteepDrag and list(vocabulary())[-1] == "steep_drag"
    (tmp_path / "own.json").write_text(json.dumps(model_to_json(diagnosis.model)))
    model = jm.read_model(tmp_path / "own.json")
    [effect] = model.effects
    assert isinstance(effect, SteepDrag) and model.effect_errors == diagnosis.model.effect_errors
    assert float(effect.volts_V) == pytest.approx(diagnosis.effects[0].parameters["volts_V"], rel=1e-12)
    score = jm.validate(model, made(2), simulations=64).open_loop.pooled
    assert score.chi2_per_sample < 1.1 and score.fit_percent > 96


def test_where_it_is_not_registered_its_model_is_refused(diagnosis, tmp_path):
    (tmp_path / "own.json").write_text(json.dumps(model_to_json(diagnosis.model)))
    with pytest.raises(jm.JaxmotorError, match=r"'steep_drag', which is none of .* registered \(jaxmotor.effects\)"):
        jm.read_model(tmp_path / "own.json")


def test_the_command_line_knows_it_where_it_is_registered(recording, installed, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    jm.write(recording, "own.csv")
    assert main(["diagnose", "own.csv", "--effects", "steep_drag"]) == 1
    assert "the effect is 'steep_drag', which is not known" in capsys.readouterr().err
    installed("steep_drag:SteepDrag")
    assert main(["diagnose", "own.csv", "--effects", "steep_drag,quadratic_drag", "-o", "out"]) == 0
    assert "drag that grows with the fifth power of the speed takes 1.2" in " ".join(capsys.readouterr().out.split())
    assert main(["report", "own.csv", "-o", "page"]) == 0
    page = (tmp_path / "page" / "own.html").read_text(encoding="utf-8")
    assert "<h3>Steep drag</h3>" in page and "fifth power of the speed takes 1.2" in page and SteepDrag.advice in page


def test_exports_carry_it_or_say_that_they_do_not(diagnosis):
    model, rig = diagnosis.model, Hardware(PERIOD_S, 617.4, 6.0)
    law = "steep_drag: v (w/50)"
    texts = {
        "control": to_python(model, rig),
        "c": to_c(model, design(model, rig)),
        "wpilib": jm.to_wpilib(model),
        "mujoco": jm.to_mujoco(model),
        "spice": jm.to_spice(model),
    }
    for format_, text in texts.items():
        assert law in text, format_
    assert '"steep_drag"' in jm.to_export_json(model)
    assert any("without steep_drag" in note for note in design(model, rig).speed.notes)


def torque(**attributes):
    """A class like `SteepDrag`, but for these attributes."""
    return type("Own", (SteepDrag,), {"name": "own", **attributes})


class WithoutUnit(SteepDrag):
    name: ClassVar[str] = "own"
    width: float = 1.0


class OfNoKind(SteepDrag):
    name: ClassVar[str] = "own"
    width: float = eqx.field(metadata={"unit": "V", "kind": "round"})


class WithoutPhase(SteepDrag):
    name: ClassVar[str] = "own"
    height_V: float = parameter("V", "amplitude", neutral=0.0, start=1.0, scale=1.0)


class WithoutLess(torque()):
    most_V: float = parameter("V", "positive", neutral=1.0, start=1.0, scale=1.0, least="least_V")
    least_V: float = parameter("V", "positive", neutral=0.0, start=1.0, scale=1.0)


class Unnamed(AbstractMotionEffect, AbstractTorqueEffect):
    @classmethod
    def starts(cls, rig):
        return ()

    def resists(self, speed, angle):
        return speed


class Lawless(AbstractMotionEffect, AbstractTorqueEffect):
    name: ClassVar[str] = "own"


class Roleless(AbstractMotionEffect):
    name: ClassVar[str] = "own"


class Placeless(AbstractTorqueEffect):
    name: ClassVar[str] = "own"


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (SteepDrag.start(), "a SteepDrag object is no effect: give its name, or a subclass of jaxmotor.motor.effects"),
        (dict, "the class dict is no effect"),
        (5, "5 is no effect"),
        (AbstractEffect, "AbstractEffect does not say where it acts: it needs a base out of AbstractDriveEffect"),
        (Placeless, "Placeless does not say where it acts"),
        (Roleless, "Roleless does not say how it acts: it needs a base out of AbstractSourceEffect"),
        (Lawless, "Lawless lacks resists, starts"),
        (Unnamed, "Unnamed lacks the attribute name"),
        (torque(says=""), "Own lacks the attribute says: what it does"),
        (torque(says="takes {volts}"), "Own.says has 'volts' in braces, which is none of its parameters"),
        (torque(says="takes {volts_V"), "Own.says has a brace"),
        (torque(name="Own Drag"), "Own.name is 'Own Drag'; use small letters"),
        (torque(name="stiction"), "Own.name is 'stiction', which jaxmotor has already"),
        (torque(name="timing_offset"), "Own.name is 'timing_offset', which jaxmotor has already"),
        (torque(holds_by="volts"), "Own.holds_by is 'volts', which is none of its parameters"),
        (torque(family=("drag",)), "Own.family is a list of 1; give a text, such as 'friction'"),
        (torque(excludes="stiction"), "Own.excludes is 'stiction'; give a tuple"),
        (
            torque(relatives=("sensor_lag",)),
            "Own.relatives has sensor_lag, which has not one parameter of the same unit",
        ),
        (WithoutUnit, "WithoutUnit.width has no unit: make it a parameter"),
        (OfNoKind, "the kind of OfNoKind.width is 'round'; it is one of positive, signed"),
        (WithoutPhase, "WithoutPhase has an amplitude; it needs a parameter phase_rad"),
        (WithoutLess, "WithoutLess.most_V has least='least_V'; both must be positive parameters"),
    ],
    ids=str,
)
def test_what_a_class_lacks_is_one_sentence(given, sentence):
    with pytest.raises(jm.JaxmotorError) as told:
        known_effect(given)
    assert str(told.value).startswith(sentence) and "\n" not in str(told.value)


def test_a_relation_to_an_effect_that_nobody_knows_is_told():
    with pytest.raises(jm.JaxmotorError, match=r"in Own.contains is 'frition', which is not known; .*friction"):
        Request(torque(contains=("frition",)))
    assert Request(torque(excludes=("timing_offset",))).effects == {"own"}


def test_two_classes_of_one_name_are_refused():
    with pytest.raises(jm.JaxmotorError, match="two classes have the name 'own'"):
        Request([torque(), torque()])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (None, "the effect broken:Own of the package own-drag cannot be imported (ModuleNotFoundError: No module"),
        ("1 / 0", "the effect broken:Own of the package own-drag cannot be imported (ZeroDivisionError"),
        ("Own = 5", "the effect broken:Own of the package own-drag: 5 is no effect"),
        (
            "from steep_drag import SteepDrag\nclass Own(SteepDrag):\n    name = 'stiction'",
            "the effect broken:Own of the package own-drag: Own.name is 'stiction', which jaxmotor has already",
        ),
    ],
)
def test_a_broken_package_is_one_sentence(text, sentence, installed, tmp_path, capsys, monkeypatch):
    if text is not None:
        (tmp_path / "broken.py").write_text(text)
    monkeypatch.delitem(sys.modules, "broken", raising=False)
    installed("broken:Own")
    with pytest.raises(jm.JaxmotorError) as told:
        Request()
    assert str(told.value).startswith(sentence)
    assert main(["diagnose", str(tmp_path / "missing.csv")]) == 1 and "Traceback" not in capsys.readouterr().err


def test_two_packages_with_one_name_are_told(installed, tmp_path, monkeypatch):
    (tmp_path / "second.py").write_text("from steep_drag import SteepDrag\nclass Other(SteepDrag):\n    pass\n")
    monkeypatch.delitem(sys.modules, "second", raising=False)
    installed("steep_drag:SteepDrag")
    installed("second:Other", "second-drag")
    with pytest.raises(jm.JaxmotorError, match="another package has an effect 'steep_drag'"):
        vocabulary()


def test_what_one_class_says_of_another_holds_both_ways():
    classes = [*jm.EFFECTS.values(), TimingOffset, LogFilter]
    assert all(excluded(one, other) == excluded(other, one) for one in classes for other in classes)
    pairs = [(one, other) for one in classes for other in classes if one.name < other.name]
    told = {(one.name, other.name) for one, other in pairs if excluded(one, other)}
    assert told == {
        ("backlash", "shaft_compliance"),
        ("bristle_friction", "coulomb_friction"),
        ("bristle_friction", "stiction"),
        ("bristle_friction", "warming_friction"),
        ("coast_drive", "dead_time"),
        ("coast_drive", "electrical_pole"),
        ("coulomb_friction", "stiction"),
        ("coulomb_friction", "warming_friction"),
        ("load_torque", "voltage_offset"),
        ("stiction", "warming_friction"),
        ("timing_offset", "transport_delay"),
    }


def test_own_relations_join_those_of_built_in_effects():
    own = torque(relatives=("load_torque",), same_as=("quadratic_drag",), excludes=("cogging",), always_tried=True)
    relations = Relations({**jm.EFFECTS, "own": own})
    assert relations.relatives("coulomb_friction") == relations.relatives("own")
    assert relations.relatives("own") == ("coulomb_friction", "dead_zone", "voltage_offset", "load_torque", "own")
    assert relations.barred([jm.EFFECTS["cogging"].start()]) == {"cogging", "own"}
    assert relations.barred([own.start()]) == {"cogging", "own", "quadratic_drag"}
    assert relations.is_told("quadratic_drag", ["own"]) and not relations.is_told("cogging", ["own"])
    assert relations.always[-1] == "own" and relations.price("own") == relations.price("supply_sag")


def test_effects_share_with_those_like_their_special_cases():
    relations = Relations(jm.EFFECTS)
    relatives = ("coulomb_friction", "dead_zone", "voltage_offset", "load_torque")
    assert relations.sharing("stiction") == relations.sharing("dead_zone") == relatives
    assert relations.sharing("quadratic_drag") == ()
    # Sought last, where a fit beside each would take long.
    assert relations.sharing("warming_friction") == ()
    # The log's, which is no effect that is sought.
    assert relations.sharing("log_filter") == relations.sharing("timing_offset") == ()


def test_no_motor_has_two_loads():
    class Flywheel(AbstractMotionEffect, AbstractLoadEffect):
        name: ClassVar[str] = "flywheel"

        @classmethod
        def starts(cls, rig):
            return ()

        def load(self): ...

    assert all(excluded(Flywheel, jm.EFFECTS[name]) for name in ("backlash", "shaft_compliance"))


def test_a_law_that_is_changed_is_compiled_anew(tmp_path):
    """A class has a name, a file and a place in it; none of these says what its law is."""

    def law(effect, speed):
        return {"volts": effect.resists(speed, speed)}

    before = jax.config.values["jax_compilation_cache_dir"]
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    try:
        run, speed, found = program(law), np.full(1, 5.0, np.float32), []
        for power in (3, 1):

            def resists(self, speed, angle, power=power):
                return self.volts_V * speed**power

            found.append(float(run(torque(resists=resists).of(volts_V=2.0), speed)["volts"][0]))
    finally:
        jax.config.update("jax_compilation_cache_dir", before)
    assert found == [250.0, 10.0]
