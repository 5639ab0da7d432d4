"""Fuzzed commands, and what the bridge's pins do: a seeded part of benchmarks/firmware_fuzz.py."""

import csv

import pytest
from _board_model import BoardModel, Refused, number
from firmware_fuzz import fuzz
from testing.wire import Script, hertz, level

PERIOD_CYCLES = 4000


def test_answers_pins_stack_and_resets_under_fuzz(build):
    result = fuzz(5000, 4)
    assert result.sound, result.notes
    assert result.runs > 20 and result.refused > 1000


def test_a_flood_of_lines_does_not_starve_the_watchdog(bench):
    """Lines without a pause: the loop must come round to feed it."""
    script = b"U 1 1000000*1D4F\n" + Script().command("Q").lines[0] * 3000
    outcome = bench(script, "--mode", "fast", torn=0)
    assert len(outcome.of("H")) == 4 and len(outcome.of("Q")) > 500


@pytest.mark.parametrize("drive", [0, 1])
@pytest.mark.parametrize("duty", [250, 200, -40, -250])
@pytest.mark.parametrize("limit", ["L 9000000 1000000 6000", "L 9000000 83 6000", "L 60 1000000 6000"])
def test_the_pins_drive_what_the_log_says_and_nothing_after_a_stop(bench, tmp_path, drive, duty, limit):
    script = Script().command(f"P 5 {drive}").command(limit).add("step", 20, b=level(duty), rest=4)
    script.add("multisine", 12, hertz(3, 0.005), level(60), 8 + 256)
    outcome = bench(bytes(script.go()), "--pins", str(tmp_path / "pins.csv"), "--until", "1.5")
    with open(tmp_path / "pins.csv") as file:
        rows = [(int(r["cycle"]), int(r["forward"]), int(r["backward"])) for r in csv.DictReader(file)]
    way, cycles = (1, 2)[duty < 0], abs(duty) * PERIOD_CYCLES // 250
    first, behind = rows[0], rows[1]
    assert first[way] == cycles and first[3 - way] == 0
    driven = sum(sample[1] == duty for sample in outcome.samples(1))
    periods = (behind[0] - first[0]) // PERIOD_CYCLES
    assert driven * 20 - 20 <= periods <= driven * 20
    assert rows[-1][1:] == (0, 0), "braking at the end"
    total = sum(abs(line.ints()[2]) for line in outcome.of("D")) * 20 * PERIOD_CYCLES / 250
    ends = [*rows[1:], rows[-1]]
    drove = sum((f + b) * (end[0] - at) / PERIOD_CYCLES for (at, f, b), end in zip(rows, ends, strict=True))
    assert drove <= total + 1e-9, "no pulse that the log does not have"


def test_a_shaft_that_only_trembles_is_stuck(bench):
    """A rotor on a stiff spring: up to one line of the encoder to and fro, half a turn of the drive after the other."""
    plant = "[shaft_compliance]\nfrequency_Hz = 0.8\ndamping_ratio = 0.02\ninertia_ratio = 10000\n"
    script = Script().add("sine", 2000, hertz(2, 0.005), level(220)).go()
    outcome = bench(bytes(script), plant=plant + "[encoder]\nstart_fraction = 0.5\n")
    counts = {count for _, _, count in outcome.samples(0)}
    assert outcome.end == "stalled" and 3 <= len(counts) <= 5


def test_the_model_refuses_what_the_page_says():
    model = BoardModel(7389)
    assert model.hears(b"G 1 7 0 0").fields == ("1", "order")
    assert model.hears(b"C 2 7").letter == "A" and model.hears(b"C 3 0").fields == ("3", "old")
    for text in ("4294967296", "-1", "1.0", "", "٣"):
        with pytest.raises(Refused):
            number(text, 0, 2**31)
