"""The same bytes whichever way they travel and however often they are asked for."""

import json
from time import monotonic, sleep

import pytest
from live import Live
from testing.wire import Script, hertz, level, seal


@pytest.fixture(scope="module")
def script():
    s = Script().command("H").command("P 5 0").command("L 1000000 100000 6000")
    s.add("step", 100, b=level(170), rest=50).add("sine", 300, hertz(5.01, 0.005), level(170), rest=50)
    return bytes(s.add("loop", 100, 7000 + (300 << 16), 16 * 19, rest=50).go())


@pytest.fixture
def expected(bench, script):
    return bench(script).raw


def test_every_run_gives_the_same_bytes(bench, script, expected):
    assert bench(script).raw == expected
    assert bench(script, "--set", "bench.seed=2").raw != expected


@pytest.mark.parametrize("transport", [("--pty",), ("--socket", "0")])
def test_live_lockstep_gives_the_bytes_of_the_script(build, script, expected, transport):
    with Live(build, transport=transport) as board:
        board.send(script[:11])
        board.send(script[11:])
        board.until(lambda line: line.type == "Z")
        while len(board.raw) < len(expected) and board.port.in_waiting:
            board.receive()
    assert board.raw == expected


def test_fast_mode_runs_the_plan(build, script):
    with Live(build, "--mode", "fast") as board:
        board.send(script)
        lines = board.until(lambda line: line.type == "Z")
    assert lines[-1].fields[0] == "done"


def test_real_mode_keeps_the_wall_clock(build):
    with Live(build, "--mode", "real") as board:
        board.send(bytes(Script().add("step", 100, b=level(100)).go()))
        board.until(lambda line: line.type == "B")
        began = monotonic()
        # No keepalive: the board stops after 250 ms of its time, which is never ahead of the wall clock. It runs from
        # 50 ms before the line is read at the most, and as late as the machine lets it.
        lines = board.until(lambda line: line.type == "Z")
        took = monotonic() - began
    assert lines[-1].fields[0] == "host_silent"
    assert took > 0.15


def test_real_mode_runs_on_while_the_host_is_heard(build):
    """Keepalives as often as they can be sent. A machine that stands still for 250 ms is a silent host."""
    for _ in range(20):
        with Live(build, "--mode", "real") as board:
            board.send(bytes(Script().add("step", 120, b=level(100)).go()))
            while not any(line.type == "Z" for line in board.lines()):
                board.send(b"K*185F\n")
                board.receive()
            [end] = [line.fields for line in board.lines() if line.type == "Z"]
        assert end[0] in ("done", "host_silent")
        if end[0] == "done":
            assert end[1] == "120"
            return
    pytest.skip("this machine stood still for 250 ms in each of 20 runs")


def test_a_slow_reader_loses_nothing(build, expected, script):
    with Live(build) as board:
        board.send(script)
        sleep(0.5)  # the terminal's buffer is full by now, and the board's time stands still
        board.until(lambda line: line.type == "Z")
        while len(board.raw) < len(expected):
            board.receive()
    assert board.raw == expected


def test_opening_the_port_again_resets_the_board(build, script):
    with Live(build, once=False) as board:
        board.send(script)
        board.until(lambda line: line.type == "D")
        board.port.close()
        sleep(0.3)
        board.open()
        board.send(script)
        lines = board.until(lambda line: line.type == "Z")
    assert [line.sequence for line in lines] == list(range(len(lines)))
    assert lines[-1].fields[0] == "done"


def test_a_host_that_hangs_up_stops_the_motor(build, tmp_path):
    stats = tmp_path / "stats.json"
    with Live(build, "--stats", str(stats)) as board:
        board.send(bytes(Script().add("step", 60000, b=level(200)).go()))
        board.until(lambda line: line.type == "D" and line.fields[1] == "100")
    told = json.loads(stats.read_text())
    assert told["plant"]["time_s"] < 30
    assert abs(told["plant"]["speed_rad_s"]) < 25  # 63 while it was driven; the bench left during braking


def test_the_wrong_baud_rate_gives_nothing(build):
    with Live(build, "--mode", "fast", baud=9600) as board:
        board.send(b"H\n")
        for _ in range(10):
            board.receive()
        received = [line for line in board.lines() if line.fields[0] == "1"]
    assert not received


@pytest.mark.parametrize("transport", [("--pty",), ("--socket", "0")])
@pytest.mark.parametrize("mode", ["lockstep", "real"])
def test_a_signal_ends_the_bench_whatever_it_waits_for(build, transport, mode):
    """For a first byte, for the next line, and for a host that reads nothing while the board talks."""
    long = bytes(Script().command("P 1 0").add("step", 60000, b=level(200)).go())
    for sent in (b"", seal("H 1"), long):
        with Live(build, "--mode", mode, transport=transport) as board:
            board.send(sent)
            sleep(0.3)
            board.process.terminate()
            assert board.process.wait(timeout=10) == 0


def test_a_host_that_dies_ends_the_bench(build):
    """Its port is closed for it, in mid-run; the bench then stops the motor and goes."""
    with Live(build) as board:
        board.send(bytes(Script().add("step", 60000, b=level(200)).go()))
        board.until(lambda line: line.type == "D" and line.fields[1] == "100")
        board.port.close()
        assert board.process.wait(timeout=20) == 0
