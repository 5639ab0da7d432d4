"""The two builds and the checked-in image."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from testing.wire import Script, hertz, level

CORE = Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino")


def test_checked_in_hex_is_the_build_of_the_sources(build):
    version = subprocess.run(["avr-gcc", "-dumpversion"], check=True, capture_output=True, text=True).stdout.strip()
    if version != "5.4.0":
        pytest.skip(f"motor_rig.hex was built with avr-gcc 5.4.0, here is {version}")
    assert (build / "motor_rig.hex").read_bytes() == (build.parent / "motor_rig.hex").read_bytes()


def test_build_is_reproducible(build, tmp_path):
    """The same bytes from another folder."""
    copy = tmp_path / "elsewhere"
    shutil.copytree(build.parent, copy, ignore=shutil.ignore_patterns("build"))
    subprocess.run(["make", "-s", "-C", copy, "firmware"], check=True, capture_output=True)
    assert (copy / "build" / "motor_rig.hex").read_bytes() == (build / "motor_rig.hex").read_bytes()


@pytest.mark.parametrize("level_", ["-O2", "-O3 -flto"])
def test_other_optimisation_behaves_the_same(bench, build, tmp_path, level_):
    """What depends on the compiler's mood (a missing volatile, a sleep without its nop) shows here."""
    elf = tmp_path / "other.elf"
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000", "-std=gnu11", *level_.split()]
    sources = [*(build.parent / "motor_rig").glob("*.c"), build.parent / "bare" / "main.c"]
    subprocess.run(["avr-gcc", *flags, *sources, "-o", elf], check=True)
    script = Script().command("P 5 1").add("prbs", 300, 9 + (5 << 8), level(200), rest=20)
    script.add("loop", 200, 7000 + (300 << 16), 16 * 19)
    usual, other = bench(bytes(script.go())), bench(bytes(script), elf=elf)
    a, b = ([line.ints() for line in outcome.of("D")] for outcome in (usual, other))
    assert [row[:2] for row in a] == [row[:2] for row in b]
    assert max(abs(x[3] - y[3]) for x, y in zip(a, b, strict=True)) <= 2
    assert other.of("Z")[0].fields == usual.of("Z")[0].fields


def test_memory(build):
    sizes = subprocess.run(["avr-size", build / "motor_rig.elf"], capture_output=True, text=True, check=True).stdout
    text, data, bss = (int(word) for word in sizes.splitlines()[1].split()[:3])
    assert text + data < 12 * 1024  # of 30 KB beside a bootloader
    assert data + bss <= 1700  # of 2048, so that 348 bytes are left for the stack


def test_sketch_only_calls_the_rig(build):
    sketch = (build.parent / "motor_rig" / "motor_rig.ino").read_text()
    code = re.sub(r"//.*", "", sketch)
    assert re.findall(r"\w+\(\);", code) == ["rig_setup();", "rig_loop();"]


def test_arduino_build_behaves_the_same(bench, build, make):
    if not CORE.exists():
        pytest.skip("no Arduino core; apt install arduino-core-avr")
    make("arduino")
    script = Script().command("P 5 0").add("step", 100, b=level(-170), rest=20)
    script.add("sine", 400, hertz(5.01, 0.005), level(170)).add("loop", 200, 7000 + (300 << 16), 16 * 19)
    bare, arduino = bench(bytes(script.go())), bench(bytes(script), elf=build / "arduino.elf")
    assert [line.fields for line in bare.of("B")] == [line.fields for line in arduino.of("B")]
    a, b = ([line.ints() for line in outcome.of("D")] for outcome in (bare, arduino))
    assert [row[:2] for row in a] == [row[:2] for row in b]
    # Interrupts enter a few cycles apart, which can move a count across a tick.
    assert max(abs(x[3] - y[3]) for x, y in zip(a, b, strict=True)) <= 2
    assert [row[2] for row in a[:520]] == [row[2] for row in b[:520]]
    assert arduino.end == "done"
