"""A command says what it does: on a terminal at once and all the time, elsewhere only where it takes long."""

import itertools
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

import pytest
from testing.made import recording, sine, step

from jaxmotor.cli import _progress
from jaxmotor.recording import write

RUNS = [sine(f) for f in (0.703, 2.009, 6.019)] + [step(5.1), step(-3.0)]
FIRST_S, SILENT_S = 2.0, 5.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("progress") / "m1.csv"
    write(recording(0, friction=0.3, runs=RUNS), path)
    return path


def on_a_terminal(arguments, folder):
    """What a command writes on a terminal as its error stream, its output, and the times of what it writes [s]."""
    master, terminal = pty.openpty()
    command = [sys.executable, "-m", "jaxmotor", *map(str, arguments)]
    environment = os.environ | {"JAXMOTOR_CACHE": str(folder), "TERM": "xterm", "COLUMNS": "120"}
    began, times, shown = time.monotonic(), [0.0], b""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=terminal, env=environment) as running:
        os.close(terminal)
        while select.select([master], [], [], 120)[0]:
            try:
                shown += os.read(master, 65536)
            except OSError:  # the other end was closed
                break
            times.append(time.monotonic() - began)
        assert running.stdout is not None
        output = running.stdout.read()
    os.close(master)
    assert running.returncode == 0, shown
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode()), output.decode(), times


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_terminal_is_never_silent(log, tmp_path, command):
    """From an empty cache, so that everything is compiled."""
    shown, output, times = on_a_terminal([command, log, "--json"], tmp_path)
    assert json.loads(output)["recording"] == "m1.csv"
    assert times[1] < FIRST_S and max(after - before for before, after in itertools.pairwise(times)) < SILENT_S
    stages = ["reading m1.csv", "loading JAX", "linear fit"]
    stages += ["effects: coulomb_friction", "held-out scoring"] if command == "diagnose" else []
    places = [shown.index(stage) for stage in stages]
    assert places == sorted(places) and re.search(r"0:00:0[1-9]", shown)


def test_plain_lines_only_where_it_takes_long(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(_progress.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(_progress, "QUIET_S", 5.0)
    with _progress.progress("reading") as tell:
        for now[0], stage in ((1.0, "early"), (6.0, "late"), (7.0, "soon after"), (12.0, "later")):
            tell(stage)
    assert capsys.readouterr() == ("", "6 s: late\n12 s: later\n")


def test_a_long_stage_is_said_again_where_there_is_no_terminal(monkeypatch, capsys):
    monkeypatch.setattr(_progress, "QUIET_S", 0.05)
    with _progress.progress("reading") as tell:
        tell("linear fit")
        time.sleep(0.5)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) > 1 and set(lines) <= {"0 s: linear fit", "1 s: linear fit"}


def test_what_is_interrupted_leaves_no_folder(log, tmp_path):
    folder = tmp_path / "new" / "results"
    # Ctrl-C counts also where the tests run in the background, in which a shell has programs ignore it.
    heeds = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"import sys; {heeds}; from jaxmotor.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "diagnose", log, "-o", folder]
    environment = os.environ | {"JAXMOTOR_CACHE": str(tmp_path / "cache")}
    with subprocess.Popen(command, stderr=subprocess.PIPE, env=environment) as running:
        deadline = time.monotonic() + 30
        while not folder.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        assert folder.exists()
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
    assert running.returncode == 130 and said.endswith(b"jaxmotor: interrupted\n")
    assert not folder.parent.exists()
