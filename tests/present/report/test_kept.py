"""What `jaxmotor diagnose` found is what `jaxmotor report` tells, without a second diagnosis."""

import dataclasses
import json
import math
from collections import OrderedDict

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from testing.made import plan, recording, sine

from jaxmotor._plain_tree import from_plain, to_plain
from jaxmotor.cli import _kept, main
from jaxmotor.cli._kept import DEFAULT, MOST, keep_diagnosis, kept_diagnosis
from jaxmotor.estimate import Joint
from jaxmotor.motor import FirstOrder
from jaxmotor.motor.effects import CoulombFriction
from jaxmotor.recording import read, write

RUNS = [*plan(), *(sine(f, amplitude=2.0) for f in (0.7037, 1.507, 3.011))]
SEED = {"seed": 0, **DEFAULT}


class OwnFriction(CoulombFriction):
    """A law that is no part of the package."""


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("kept") / "kept.csv"
    write(recording(3, friction=0.2, runs=RUNS), path)
    return path


@pytest.fixture(scope="module")
def cache(log):
    """The folder in which a diagnosis of `log` was kept: that of the tests' compiled programs."""
    folder = jax.config.values["jax_compilation_cache_dir"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JAXMOTOR_CACHE", folder)
        assert main(["diagnose", str(log)]) == 0
    return folder


@pytest.fixture
def kept(log, cache, monkeypatch):
    """The diagnosis and its file."""
    monkeypatch.setenv("JAXMOTOR_CACHE", cache)
    found = kept_diagnosis(read(log), SEED)
    assert found is not None
    return found


@pytest.fixture
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.setenv("JAXMOTOR_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_the_page_is_that_of_a_new_diagnosis(log, kept, capsys, tmp_path):
    pages, said = [], []
    for options in ([], ["--anew"]):
        assert main(["report", str(log), "-o", str(tmp_path), *options]) == 0
        said.append(capsys.readouterr().out.splitlines())
        pages.append((tmp_path / "kept.html").read_text(encoding="utf-8"))
    assert pages[0] == pages[1]
    note = f"the diagnosis is that of jaxmotor diagnose, kept in {kept[1]}; --anew makes it again"
    assert said[0] == [note, *said[1]]


def test_another_question_has_another_answer(log, kept, cache, monkeypatch):
    logged = read(log)
    for options in ({"seed": 1}, {"effects": ["dead_zone"]}, {"exclude": ["coulomb_friction"]}):
        assert kept_diagnosis(logged, SEED | options) is None, options
    [first, *others] = logged.segments
    volts = first.volts.copy()
    volts[7] = np.nextafter(volts[7], 1e9)
    changed = dataclasses.replace(logged, segments=(dataclasses.replace(first, volts=volts), *others))
    assert kept_diagnosis(changed, SEED) is None
    assert kept_diagnosis(dataclasses.replace(logged, supply_V=12.34), SEED) is None
    monkeypatch.setattr(_kept, "_program", lambda: ["another version"])
    assert kept_diagnosis(logged, SEED) is None
    monkeypatch.undo()
    monkeypatch.setenv("JAXMOTOR_CACHE", "")
    assert kept_diagnosis(logged, SEED) is None


def test_a_damaged_one_is_made_again(log, kept, elsewhere):
    logged, (diagnosis, _) = read(log), kept
    keep_diagnosis(diagnosis, logged, SEED)
    [path] = elsewhere.iterdir()
    whole = path.read_bytes()
    for place in np.linspace(0, len(whole) - 1, 40).astype(int):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        assert kept_diagnosis(logged, SEED) is None, place
        path.write_bytes(whole[:place])
        assert kept_diagnosis(logged, SEED) is None, place
    path.write_bytes(whole)
    assert kept_diagnosis(logged, SEED) is not None


def test_only_the_latest_are_kept(log, kept, elsewhere):
    for seed in range(MOST + 2):
        keep_diagnosis(kept[0], read(log), SEED | {"seed": seed})
    assert len(list(elsewhere.iterdir())) == MOST
    assert kept_diagnosis(read(log), SEED | {"seed": MOST + 1}) is not None


def test_laws_of_somebody_elses_are_not_kept(log, kept, elsewhere):
    [found] = kept[0].effects
    own = dataclasses.replace(kept[0], effects=(dataclasses.replace(found, effect=OwnFriction.start()),))
    keep_diagnosis(own, read(log), SEED)
    assert not list(elsewhere.iterdir())


def test_plain_data_gives_the_same_again(x64):
    motor = jax.tree.map(np.asarray, FirstOrder(jnp.asarray(0.1), jnp.asarray(2.0)))
    tree = {
        "numbers": (1, -0.0, 0.1 + 0.2, math.inf, -math.inf, True, None, "\N{GREEK SMALL LETTER TAU}\ud800"),
        7: [np.float64(math.pi), np.int32(3), np.bool_(False)],
        "arrays": (
            np.zeros((0, 3)),
            np.array([np.nan, 5e-324]),
            np.arange(6, dtype=">i2").reshape(3, 2),
            np.array("m"),
        ),
        "sets": frozenset({"a"}),
        "own": (motor, jnp.asarray(np.float64(0.1)), Joint(("gain",), np.eye(1))),
    }
    again = from_plain(json.loads(json.dumps(to_plain(tree))))
    assert repr(again) == repr(tree | {7: [math.pi, 3, False]})
    assert math.copysign(1, again["numbers"][1]) == -1
    own, of_jax, joint = again["own"]
    assert isinstance(own.gain, np.ndarray) and isinstance(of_jax, jax.Array) and type(joint) is Joint
    assert of_jax.dtype == own.pole.dtype == np.float64
    for one, other in zip(again["arrays"], tree["arrays"], strict=True):
        assert one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()


@pytest.mark.parametrize(
    "node", [object(), np.array([object()]), print, OrderedDict, {"a": {1, 2}}, OwnFriction.start()]
)
def test_what_is_no_plain_data_is_refused(node):
    with pytest.raises(TypeError, match="plain data"):
        to_plain(node)


@pytest.mark.parametrize(
    "name", ["subprocess:Popen", "jaxmotor.cli._kept:Path", "jaxmotor.cli._kept:keep_diagnosis", "builtins:eval", ""]
)
def test_no_other_class_is_made_of_plain_data(name):
    with pytest.raises(ValueError, match="no class of results"):
        from_plain({"class": name, "fields": []})
