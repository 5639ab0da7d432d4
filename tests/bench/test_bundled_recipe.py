"""The bundled recordings of the emulated bench come out of their recipe bit for bit."""

import pytest
from record_bundled import FILES, FOLDER, record_bundled

from jaxmotor import identify
from jaxmotor.recording import check, read


def test_the_recipe_gives_the_bytes(emulator, tmp_path):
    written = record_bundled(tmp_path)
    assert [path.name for path in written] == list(FILES)
    for path in written:
        # Compared as a whole: where they differ pytest would look for how, line by line, for hours.
        same = path.read_bytes() == (FOLDER / path.name).read_bytes()
        assert same, f"run benchmarks/record_bundled.py: {path.name}"


@pytest.mark.parametrize("name", FILES)
def test_they_are_sound(name):
    recording = read(FOLDER / name)
    assert check(recording) == ()
    assert recording.header["lost_samples"] == 0


def test_the_motor_is_plausible():
    """Friction of 0.2 V makes a linear motor of 10.6 rad/s/V look a little weaker."""
    fit = identify(read(FOLDER / "paper.csv"))
    assert 9.5 < float(fit.motor.gain) < 10.6
    assert 36 < float(fit.motor.pole) < 44
