"""Recordings from the emulated board, and from boards, lines and recorders that die on the way."""

import hashlib
import itertools
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from faults import PLAN, RECORDER, SLOW, Relay, disconnect, kill, short_plan
from testing.line import noise, samples_in, samples_of

from jaxmotor import identify
from jaxmotor.bench import Incomplete, Port, RecorderError, parse_plan, record, recover
from jaxmotor.bench._journal import read_journal
from jaxmotor.bench._listen import Silent
from jaxmotor.recording import check, lost_ticks, read

PAPER = """
period_ms = 5
supply_V = 7.4
rest_s = 0.3
detune = true
[[experiment]]
kind = "sine"
frequency_Hz = [0.5, 1, 2, 4, 7, 10]
amplitude_V = 5.1
duration_s = 3
[[experiment]]
kind = "step"
amplitude_V = [5.1, -4.3, 3.5]
duration_s = 0.6
[[experiment]]
kind = "closed_loop"
reference_rad_s = 37.7
gain = 0.4
duration_s = 0.8
"""
GAIN, POLE = 10.6, 40.0
"""Of the emulated bench's motor, when no plant file says otherwise."""


def emulated(*options):
    return lambda: Port("emulated", options=options)


@pytest.fixture(scope="module")
def paper(emulator, tmp_path_factory):
    output = tmp_path_factory.mktemp("paper") / "r.csv"
    return record(parse_plan(PAPER, "paper"), emulated(), output), output


def test_gain_and_pole_are_the_plants_own(paper):
    recording, output = paper
    fit = identify(read(output))
    assert float(fit.motor.gain) == pytest.approx(GAIN, rel=0.01)
    assert float(fit.motor.pole) == pytest.approx(POLE, rel=0.01)
    assert check(recording) == ()


def test_the_recording_says_what_was_done(paper):
    recording, output = paper
    kinds = [segment.kind for segment in recording.segments]
    assert kinds == ["rest", "sine"] * 6 + ["rest", "step"] * 3 + ["rest", "closed_loop"]
    assert all(segment.at_rest for segment in recording.segments if segment.kind != "rest")
    assert not any(segment.at_rest for segment in recording.segments[2:] if segment.kind == "rest")
    assert recording.header["lost_samples"] == 0 and sum(map(lost_ticks, recording.segments)) == 0
    starts = [segment.start_s for segment in recording.segments]
    assert np.allclose(np.diff(starts), [len(segment) * 0.005 for segment in recording.segments[:-1]])
    assert 7.2 < recording.segments[5].supply_V[50] < 7.45
    assert not output.with_name("r.csv.part").exists()


def test_the_duty_is_the_planned_sine(paper):
    segment = paper[0].segments[7]
    ideal = 5.1 * np.sin(2 * np.pi * segment.parameters["frequency_Hz"] * segment.time_s)
    assert np.abs(segment.volts - ideal).max() < 0.6 * 7.4 / 250


def test_the_loop_is_the_boards(paper):
    """Gain and reference in the header give the duties digit for digit."""
    segment, per = paper[0].segments[-1], 617.4 * 0.005 / (2 * np.pi)
    speed = np.diff(segment.count) / per
    ideal = np.clip(segment.parameters["gain"] * (segment.parameters["reference_rad_s"] - speed), -7.4, 7.4)
    assert np.abs(segment.volts[1:] - ideal).max() < 0.51 * 7.4 / 250


def test_every_run_is_the_same(paper, tmp_path):
    again = tmp_path / "again.csv"
    record(parse_plan(PAPER, "paper"), emulated(), again)
    first, second = (hashlib.sha256(path.read_bytes()).hexdigest() for path in (paper[1], again))
    assert first == second


def test_a_long_plan_runs_in_parts(emulator, tmp_path):
    text = '[[experiment]]\nkind = "step"\namplitude_V = 3\nduration_s = 0.1\nrest_s = 0.1\nrepeat = 70\n'
    recording = record(parse_plan(text, "p"), emulated(), tmp_path / "r.csv", check=False)
    assert [segment.kind for segment in recording.segments] == ["rest", "step"] * 70
    assert not recording.count_resets


def test_a_kilohertz(emulator, tmp_path):
    text = "period_ms = 1\n" + PLAN.replace("period_ms = 5\n", "")
    recording = record(parse_plan(text, "p"), emulated(), tmp_path / "r.csv", check=False)
    assert recording.period_s == 0.001
    assert sum(map(lost_ticks, recording.segments)) == 0


class Impatient(Silent):
    """Presses Ctrl-C, or skips, at the `at`-th look."""

    def __init__(self, at: int, skips: bool = False):
        self.dependences, self.skips = itertools.count(), skips
        self.at = at

    def enough(self, run, piece) -> bool:
        if next(self.dependences) != self.at:
            return False
        if not self.skips:
            raise KeyboardInterrupt
        return True


def test_a_segment_ends_early_when_it_may(emulator, tmp_path):
    text = PLAN.replace("duration_s = 1.5", "duration_s = 100")
    recording = record(parse_plan(text, "p"), emulated(), tmp_path / "r.csv", check=False, watch=Impatient(5, True))
    assert [segment.kind for segment in recording.segments] == ["rest", "sine"] * 2 + ["rest", "step"] * 2
    assert len(recording.segments[1]) < len(recording.segments[3]) == 20_000
    assert recording.segments[2].start_s == pytest.approx(
        recording.segments[1].start_s + len(recording.segments[1]) * 0.005
    )


def test_interrupted_then_resumed(emulator, tmp_path):
    output, plan = tmp_path / "r.csv", short_plan(PLAN.replace("duration_s = 1.5", "duration_s = 20"))
    with pytest.raises(KeyboardInterrupt):
        record(plan, emulated(), output, check=False, watch=Impatient(3))
    first = read(output)
    assert first.segments[-1].parameters.get("interrupted") and len(first.segments) < 8
    with pytest.raises(RecorderError, match="--resume"):
        record(plan, emulated(), output)
    recording = record(None, emulated(), output, resume=True, check=False)
    done = [s for s in recording.segments if s.kind != "rest" and "interrupted" not in s.parameters]
    assert [segment.kind for segment in done] == ["sine", "sine", "step", "step"]
    assert recording.count_resets
    for before, after in zip(first.segments, recording.segments, strict=False):
        assert np.array_equal(before.count, after.count)
    assert [path.name for path in tmp_path.iterdir()] == ["r.csv"]


@pytest.mark.parametrize("at", [700, 5_000, 12_345, 20_000])
def test_a_line_that_breaks_loses_nothing_that_came(emulator, tmp_path, at):
    sent, came, wrong = disconnect(at, tmp_path)
    assert wrong == 0
    assert sent - came < 20, "fewer than make a segment"


def test_an_unplugged_board_is_a_sentence_and_resumable(emulator, tmp_path):
    output = tmp_path / "r.csv"
    with Relay(cut_after=9000) as relay, pytest.raises(RecorderError, match=r"vanished.*--resume"):
        record(short_plan(), lambda: Port(relay.url), output, check=False)
    assert len(read(output).segments) >= 2
    with Relay() as relay:
        recording = record(None, lambda: Port(relay.url), output, resume=True, check=False)
    assert sum(segment.kind == "step" for segment in recording.segments) == 2


def test_a_noisy_line_leaves_gaps_that_are_told_and_no_wrong_sample(emulator, tmp_path):
    plan = short_plan()
    with Relay(noise(5e-4, random.Random(3))) as relay, pytest.raises(Incomplete, match="lost on the line") as caught:
        record(plan, lambda: Port(relay.url), tmp_path / "r.csv", check=False)
    sent, recording = samples_in(bytes(relay.said)), caught.value.recording
    came = samples_of(recording, plan)
    assert came.items() <= sent.items()
    assert 0 < len(sent) - len(came) < 0.2 * len(sent)
    assert f"{len(came)} of {len(sent)} samples came" in str(caught.value)
    assert recording.header["lost_samples"] == len(sent) - len(came) and recording.header["damaged_lines"] > 0
    assert (tmp_path / "r.csv.part").exists()


def test_a_killed_recorder_leaves_what_had_come(emulator, tmp_path):
    arrived, wrong, oldest = kill(0.7, tmp_path)
    assert arrived > 50 and wrong == 0 and oldest < 1.0


def test_a_journal_torn_anywhere_is_read_to_the_tear(emulator, tmp_path):
    with Relay(cut_after=15_000) as relay, pytest.raises(RecorderError):
        record(short_plan(), lambda: Port(relay.url), tmp_path / "r.csv", check=False)
    data, torn = (tmp_path / "r.csv.part").read_bytes(), tmp_path / "t.csv.part"
    begins = data.index(b"\nB ")
    whole = samples_of(recover(tmp_path / "r.csv"), short_plan())
    for at in random.Random(2).sample(range(begins + 800, len(data)), 20):
        torn.write_bytes(data[:at])
        assert samples_of(recover(tmp_path / "t.csv"), short_plan()).items() <= whole.items()
    assert read_journal(torn).plan == short_plan()


def test_a_board_reset_in_mid_run(emulator, tmp_path):
    with pytest.raises(RecorderError, match=r"reset in mid-run.*--resume"):
        record(short_plan(), emulated("--hang-at", "2.0", "--mode", "real"), tmp_path / "r.csv", check=False)
    assert len(read(tmp_path / "r.csv").segments) >= 2


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("wiring.jammed_at_s=1.5", "stuck"),
        ("battery.cutoff_at_s=1.5", "supply"),
    ],
)
def test_the_boards_own_reasons_are_told_apart(emulator, tmp_path, setting, said):
    options = ["--set", setting] + (["--set", "battery.cutoff_V=4"] if "cutoff" in setting else [])
    text = '[[experiment]]\nkind = "step"\namplitude_V = 5\nduration_s = 6\n'
    with pytest.raises(RecorderError, match=said):
        record(parse_plan(text, "p"), emulated(*options), tmp_path / "r.csv", check=False)
    assert read(tmp_path / "r.csv").segments[-1].parameters["interrupted"]


def test_the_travel_limit(emulator, tmp_path):
    text = 'travel_rev = 3\n[[experiment]]\nkind = "step"\namplitude_V = 5\nduration_s = 6\n'
    with pytest.raises(RecorderError, match="travel_rev"):
        record(parse_plan(text, "p"), emulated(), tmp_path / "r.csv", check=False)


def test_a_host_that_falls_silent(emulator, tmp_path):
    with pytest.raises(RecorderError, match="250 ms"):
        record(short_plan(), emulated("--keepalive-until", "2"), tmp_path / "r.csv", check=False)


def test_a_full_disk_is_a_sentence_and_keeps_what_was_written(emulator, tmp_path):
    """Stands in for a full disk: the file may grow to 12 kB only."""
    output = tmp_path / "r.csv"
    code = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (12000, 12000))\n{RECORDER}"
    code = code.replace("import sys\n", "import sys, jaxmotor.bench\n")
    done = subprocess.run([sys.executable, "-c", code, PLAN, "emulated", str(output)], capture_output=True, check=False)
    assert b"make room, then continue with --resume" in done.stderr
    part = output.with_name("r.csv.part")
    assert part.stat().st_size == 12_000
    assert len(recover(output).segments) > 1


def test_ctrl_c_stops_the_motor_and_leaves_a_valid_recording(emulator, tmp_path):
    output = tmp_path / "r.csv"
    with Relay(mode="real") as relay:
        process = subprocess.Popen(
            [sys.executable, "-c", RECORDER, PLAN, relay.url, str(output)], stderr=subprocess.DEVNULL
        )
        while b"\nD " not in relay.said:
            time.sleep(0.01)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        process.wait(timeout=10)
        assert b" stopped " in relay.said
    assert len(read(output).segments) >= 1


@pytest.mark.parametrize("moment", [1.2, 1.31, 1.43])
def test_ctrl_c_loses_no_sample(emulator, tmp_path, moment):
    """At full speed, where it is likely to fall between two hands."""
    output = tmp_path / "r.csv"
    command = [sys.executable, "-c", RECORDER, SLOW, "emulated", str(output)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    while not output.with_name("r.csv.part").exists():
        time.sleep(0.01)
    time.sleep(moment - 1)
    process.send_signal(signal.SIGINT)
    process.wait(timeout=10)
    assert sum(map(lost_ticks, read(output).segments)) == 0


def test_two_recorders_do_not_write_one_file(emulator, tmp_path):
    from jaxmotor.bench._journal import Journal

    journal = Journal(tmp_path / "r.csv.part", short_plan())
    with pytest.raises(RecorderError, match="another recorder"):
        Journal(tmp_path / "r.csv.part")
    journal.close()


def test_what_is_there_is_not_overwritten(tmp_path):
    output = tmp_path / "r.csv"
    output.write_text("precious")
    with pytest.raises(RecorderError, match="--force"):
        record(short_plan(), emulated(), output)
    with pytest.raises(RecorderError, match="folder does not exist"):
        record(short_plan(), emulated(), tmp_path / "no" / "r.csv")
    with pytest.raises(RecorderError, match="nothing to continue"):
        record(None, emulated(), output, resume=True)
    assert output.read_text() == "precious" and os.listdir(tmp_path) == ["r.csv"]


class Unplugging(Silent):
    """Ends the emulator at the first look, as a pulled plug ends a board."""

    def __init__(self):
        self.port = None

    def open(self) -> Port:
        self.port = Port("emulated")
        return self.port

    def enough(self, run, piece) -> bool:
        os.kill(self.port.emulator.pid, signal.SIGKILL)
        return False


def test_a_serial_port_that_vanishes(emulator, tmp_path):
    watch = Unplugging()
    with pytest.raises(RecorderError, match=r"vanished.*--resume"):
        record(short_plan(SLOW), watch.open, tmp_path / "r.csv", check=False, watch=watch)
    assert len(read(tmp_path / "r.csv").segments) >= 1
