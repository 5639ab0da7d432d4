"""Each effect has its page: equation, how it shows, picture, reference; and the pictures show the law."""

import effect_signatures
import numpy as np
import pytest
from pages import DOCS, blocks

from jaxmotor.motor import EFFECTS
from jaxmotor.motor.effects import parameters
from jaxmotor.text import capital, named

FOLDER = DOCS / "effects"


@pytest.mark.parametrize("name", EFFECTS)
def test_page(name):
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert text.startswith(f"# {capital(named(name))} (`{name}`)\n")
    assert [block for block in blocks(FOLDER / f"{name}.md") if block.language == "math"], "its equation"
    assert "**How it shows.** " in text and "**Reference.** " in text
    assert f"(../img/effects/{name}.png)" in text
    assert all(f"`{parameter}`" in text for parameter in parameters(EFFECTS[name]))
    assert f"[{capital(named(name))}]({name}.md) `{name}`" in (FOLDER / "index.md").read_text(encoding="utf-8")


def test_pictures_are_small_and_of_effects_that_exist():
    pictures = list((DOCS / "img" / "effects").iterdir())
    assert {picture.stem for picture in pictures} == set(EFFECTS) == set(effect_signatures.CASES)
    assert max(picture.stat().st_size for picture in pictures) < 25_000


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("direction_asymmetry", lambda volts: 0.05 * np.abs(volts)),
        ("dead_zone", lambda volts: np.sign(volts) * np.maximum(np.abs(volts) - 0.35, 0) - volts),
    ],
)
def test_the_missing_voltage_is_the_law(name, law):
    """An effect on the voltage lacks, tick by tick, what its law takes."""
    case = effect_signatures.CASES[name]
    lacking = effect_signatures.lacking(name, case, effect_signatures.moved(name, case))
    np.testing.assert_allclose(lacking, law(effect_signatures.signal(case.signal))[:-1], atol=1e-9)


def test_friction_lacks_its_volts_against_the_motion():
    case = effect_signatures.CASES["coulomb_friction"]
    seen = effect_signatures.moved("coulomb_friction", case)
    lacking = effect_signatures.lacking("coulomb_friction", case, seen)
    moving = np.minimum(np.abs(seen.speed[1:]), np.abs(seen.speed[:-1])) > 0.1
    np.testing.assert_allclose(lacking[moving], -0.4 * np.sign(seen.speed[:-1][moving]), atol=1e-6)


def test_a_picture_is_drawn(tmp_path):
    path = effect_signatures.draw("load_torque", tmp_path)
    assert path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size < 25_000
