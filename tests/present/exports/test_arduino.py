"""The Arduino library: a folder that the IDE takes, whose sketch holds a speed on the emulated board."""

import math
import shutil
import subprocess
from pathlib import Path

import pytest
from testing.built import BUILD, FIRMWARE
from testing.exported import draw

from jaxmotor import JaxmotorError
from jaxmotor.present.exports import design, to_arduino, to_c, write_library

CORE = Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino")


@pytest.fixture(scope="module")
def drawn():
    return draw(6)


def test_the_folder_is_a_library(drawn, tmp_path):
    made = design(drawn.model, drawn.hardware)
    folder = tmp_path / "JaxmotorMotor"
    write_library(folder, to_arduino(drawn.model, made))
    properties = dict(line.split("=", 1) for line in (folder / "library.properties").read_text().splitlines())
    assert {"name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url"} <= set(properties)
    assert properties["includes"] == "JaxmotorMotor.h" and properties["architectures"] == "*"
    assert (folder / "src" / "JaxmotorMotor.h").read_text() == to_c(drawn.model, made)
    assert (folder / "examples" / "SpeedLoop" / "SpeedLoop.ino").is_file()
    write_library(folder, to_arduino(drawn.model, made))


def test_another_folder_is_left_alone(drawn, tmp_path):
    library = to_arduino(drawn.model, design(drawn.model, drawn.hardware))
    (tmp_path / "mine.txt").write_text("precious")
    with pytest.raises(JaxmotorError, match="something else in it"):
        write_library(tmp_path, library)
    with pytest.raises(JaxmotorError, match="something else in it"):
        write_library(tmp_path / "mine.txt", library)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_the_sketch_holds_its_speed_on_the_emulated_board(drawn, tmp_path, emulator):
    if not CORE.exists() or not shutil.which("avr-g++"):
        pytest.skip("no Arduino core; apt install arduino-core-avr")
    folder, elf = tmp_path / "JaxmotorMotor", tmp_path / "sketch.elf"
    write_library(folder, to_arduino(drawn.model, design(drawn.model, drawn.hardware)))
    sketch = folder / "examples" / "SpeedLoop" / "SpeedLoop.ino"
    make = ["make", "-C", FIRMWARE, "sketch", f"SKETCH={sketch}", f"INCLUDE={folder / 'src'}", f"ELF={elf}"]
    subprocess.run(make, check=True, capture_output=True)
    (tmp_path / "plant.toml").write_text(drawn.toml)
    bench = [BUILD / "bench", "--elf", elf, "--plant", tmp_path / "plant.toml", "--until", "3"]
    done = subprocess.run(bench, input=b"", check=True, capture_output=True, timeout=60)
    counts = [int(line.split()[0]) for line in done.stdout.decode().splitlines() if len(line.split()) == 2]
    assert len(counts) >= 25
    speed = (counts[-2] - counts[-12]) / drawn.hardware.counts_per_rev * 2 * math.pi
    assert speed == pytest.approx(20.0, rel=0.01)
