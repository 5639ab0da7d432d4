"""Everything that stops the motor, each with its own reason."""

import math

import pytest
from testing.wire import Script, level, seal

FULL = level(250)


def long_step(duty=FULL, limits="L 2000000 1000000 6000"):
    return bytes(Script().command(limits).add("step", 3000, b=duty).go())


def stopped(outcome):
    """The run's last moment: reason, ticks, and that nothing came after it."""
    assert outcome.lines[-1].type == "Z"
    [end] = outcome.of("E")
    assert end.fields[1] == outcome.end
    return outcome.end, int(end.fields[2])


def test_silent_host(bench):
    reason, ticks = stopped(bench(long_step(level(100)), "--keepalive-until", "2"))
    assert reason == "host_silent"
    # The last keepalive came 1.9 s after the reset; the run began somewhat earlier than 0.2 s.
    assert 2.1 - 0.2 < ticks * 0.005 < 2.2


def test_silence_is_timed_to_the_millisecond(bench):
    # One line in mid-run, then nothing: a stop 250 ms after it.
    outcome = bench(long_step(level(100)), "--keepalive-until", "0")
    reason, ticks = stopped(outcome)
    assert reason == "host_silent"
    assert ticks * 5 in range(245, 256)


def test_jammed_shaft(bench):
    reason, ticks = stopped(bench(long_step(), plant="[wiring]\njammed_at_s = 2.0\n"))
    assert reason == "stalled"
    assert 2.9 < 0.005 * ticks + 0.15 < 3.15


def test_unplugged_encoder(bench):
    reason, ticks = stopped(bench(long_step(), plant="[wiring]\nunplugged_at_s = 0.0\n"))
    assert reason == "stalled"
    assert ticks == 200


def test_unplugged_encoder_is_found_under_a_sine_too(bench):
    script = Script().add("sine", 4000, 42949673, level(200)).go()  # 2 Hz
    reason, ticks = stopped(bench(bytes(script), plant="[wiring]\nunplugged_at_s = 0.0\n"))
    assert reason == "stalled"
    assert ticks < 600


def test_slow_under_load_is_no_stall(bench):
    """One count in 20 ms at more than half the duty."""
    script = Script().add("step", 600, b=level(130)).go()
    outcome = bench(bytes(script), plant="[coulomb_friction]\nvolts_V = 3.8\n")
    assert outcome.end == "done"
    assert 50 < abs(int(outcome.of("E")[0].fields[3])) < 300


def test_low_duty_at_rest_is_no_stall(bench):
    script = Script().add("step", 500, b=level(20)).go()
    assert bench(bytes(script), plant="[coulomb_friction]\nvolts_V = 1.0\n").end == "done"


def test_low_supply(bench):
    reason, ticks = stopped(bench(long_step(level(60)), plant="[battery]\ncutoff_at_s = 3.0\ncutoff_V = 5.5\n"))
    assert reason == "low_supply"
    assert 2.8 < ticks * 0.005 + 0.1 < 3.1


def test_low_supply_refuses_to_start(bench):
    outcome = bench(long_step(), plant="[battery]\nvolts_V = 5.9\n")
    assert outcome.of("N")[0].fields[1] == "supply"
    assert not outcome.of("B")


def test_supply_limit_can_be_switched_off(bench):
    script = Script().command("L 2000000 1000000 0").add("step", 20, b=FULL).go()
    assert bench(bytes(script), plant="[battery]\nvolts_V = 5.0\n").end == "done"


@pytest.mark.parametrize("duty", [FULL, -FULL])
def test_travel_limit(bench, duty):
    outcome = bench(long_step(duty, "L 5000 1000000 6000"))
    reason, _ = stopped(outcome)
    assert reason == "travel_limit"
    reached = abs(int(outcome.of("E")[0].fields[3]))
    assert 5000 < reached < 5020


def test_time_limit(bench):
    reason, ticks = stopped(bench(long_step(level(100), "L 2000000 1234 6000")))
    assert reason == "time_limit"
    assert ticks == 247


def test_watchdog_restarts_a_hung_board_with_the_motor_off(bench):
    outcome = bench(long_step(), "--hang-at", "2.0", "--until", "3.0", torn=1)
    causes = [field for line in outcome.of("H") for field in line.fields if field.startswith("reset=")]
    assert causes == ["reset=power", "reset=watchdog"]
    # An open winding leaves only the viscous friction: 40 rad/s x 0.045 from 78 rad/s, for 0.85 s or more.
    assert abs(outcome.stats["plant"]["speed_rad_s"]) < 78 * math.exp(-40 * 0.045 * 0.85)


def test_brake_after_a_stop(bench):
    """The winding is shorted: the motor loses its speed with its own time constant (1/40 s)."""
    outcome = bench(long_step(FULL, "L 2000000 1500 6000"), "--until", "2.2")
    assert outcome.end == "time_limit"
    assert abs(outcome.stats["plant"]["speed_rad_s"]) < 1


def test_a_run_after_a_stop(bench):
    """What stopped one run does not stop the next."""
    again = Script(run=8, first=9).command("L 5000 1000000 6000").add("step", 3000, b=FULL).go()
    outcome = bench(long_step(FULL, "L 5000 1000000 6000") + bytes(again) + seal("Q 20"))
    assert [(line.run, line.fields[0]) for line in outcome.of("Z")] == [(7, "travel_limit"), (8, "travel_limit")]
    assert outcome.of("Q")[0].fields[1:3] == ("8", "travel_limit")
