"""The impossible is refused, the doubtful is named, and sound recordings raise no alarm."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import TEXT, counted

from jaxmotor.recording import Recording, RecordingError, Segment, check, from_arrays, lost_ticks
from jaxmotor.recording._bunches import warn_bunches
from jaxmotor.recording._check import (
    check_input,
    check_output,
    check_sines,
    warn_beyond_supply,
    warn_lost_ticks,
    warn_overlap,
    warn_repetition,
    warn_saturation,
    warn_unknowns,
)
from jaxmotor.recording._direction import AT_ZERO, warn_early, warn_sign, warn_zero
from jaxmotor.recording._jumps import check_jumps, spikes
from jaxmotor.recording._read import parse

TICKS = np.arange(2000)


def motor(volts, *, gain=3.0, pole=0.2, friction=0.0):
    """Counts per tick of a motor with Coulomb friction [V], `gain` in counts per tick and volt, `pole` per tick."""
    speed, speeds = 0.0, []
    decay = np.exp(-pole)
    for volt in volts:
        free = decay * speed + gain * (1 - decay) * volt
        speed = np.sign(free) * max(abs(free) - gain * (1 - decay) * friction, 0.0)
        speeds.append(speed)
    return np.array(speeds)


def moved(volts, **parameters):
    return counted(volts, motor(volts, **parameters))


def with_count(recording, count):
    return dataclasses.replace(recording, segments=(dataclasses.replace(recording.segments[0], count=count),))


def prbs(bit, seed=0):
    return 6.0 * np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], len(TICKS) // bit + 1), bit)[: len(TICKS)]


SOUND = {
    "step": np.where(TICKS < 500, 0.0, 6.0),
    "late short step": np.where((TICKS > 1950) & (TICKS < 1960), 12.0, 0.0),
    "steps": 6.0 * np.sign(np.sin(TICKS * 0.01)),
    "sine": 6.0 * np.sin(TICKS * 0.0331),
    "fast sine": 6.0 * np.sin(TICKS * 1.3),
    "PRBS": prbs(5),
    "PRBS of one tick": prbs(1),
    "single pulse": np.where(TICKS == 700, 12.0, 0.0),
    "ramp": TICKS * 0.002,
    "chirp": 6.0 * np.sin(TICKS**2 * 4e-4),
}


@pytest.mark.parametrize("pole", [0.02, 0.2, 1.0, 3.0])
@pytest.mark.parametrize("gain", [0.05, 3.0, 200.0])
@pytest.mark.parametrize("volts", SOUND.values(), ids=SOUND)
def test_sound_recordings_pass(volts, gain, pole):
    """A jump would be an error."""
    for friction in (0.0, 1.0):
        assert check_jumps(moved(volts, gain=gain, pole=pole, friction=friction)) is None


def test_sound_recording_has_no_warnings():
    assert check(moved(SOUND["steps"])) == ()


@settings(max_examples=60)
@given(
    st.integers(2, 1996), st.sampled_from([2**16, 2**24, 2**32, 100_000]), st.booleans(), st.sampled_from(sorted(SOUND))
)
def test_any_large_jump_is_found(row, size, back, name):
    recording = moved(SOUND[name])
    count = recording.segments[0].count.copy()
    count[row:] += -size if back else size
    with pytest.raises(RecordingError, match=f"segment 0 at tick {row}, more than the supply could cause"):
        check_jumps(with_count(recording, count))


@settings(max_examples=40)
@given(st.integers(3, 1995), st.sampled_from([500, -500, 2**15]))
def test_glitch_of_one_row_is_found(row, size):
    recording = moved(SOUND["sine"])
    count = recording.segments[0].count.copy()
    count[row] += size
    with pytest.raises(RecordingError, match=f"at tick {row}"):
        check_jumps(with_count(recording, count))


def test_jumps_are_told_apart():
    recording = moved(SOUND["step"], gain=10.0)
    count = recording.segments[0].count
    wrapped = count.astype(np.int16).astype(np.int64)
    assert (wrapped != count).any()
    with pytest.raises(RecordingError, match="16-bit counter wrapped"):
        check_jumps(with_count(recording, wrapped))
    often = moved(np.full(2000, 12.0), gain=100.0)
    with pytest.raises(RecordingError, match="16-bit counter wrapped"):
        check_jumps(with_count(often, often.segments[0].count.astype(np.int16).astype(np.int64)))
    reset = np.where(TICKS < 900, count, count - count[900])
    with pytest.raises(RecordingError, match="set back"):
        check_jumps(with_count(recording, reset))
    with pytest.raises(RecordingError, match="wiring"):
        check_jumps(with_count(recording, np.where(TICKS < 900, count, count + 5000)))


def sped(volts, speed):
    return from_arrays(time_s=0.01 * np.arange(len(volts)), volts=volts, speed_rad_s=speed)


@pytest.mark.parametrize("pole", [0.02, 0.2, 1.0, 3.0])
@pytest.mark.parametrize("volts", SOUND.values(), ids=SOUND)
def test_sound_speeds_have_no_spikes(volts, pole):
    for friction in (0.0, 1.0):
        for step in (1e-9, 0.3):
            assert spikes(sped(volts, step * np.round(motor(volts, pole=pole, friction=friction) / step))) == []


@pytest.mark.parametrize("row", [1, 388, 1998])
def test_a_speed_of_one_row_that_no_motor_has_is_told(row):
    speed = motor(SOUND["step"])
    assert not any("for that row only" in sentence for sentence in check(sped(SOUND["step"], speed)))
    speed[[row, 700]] = -12854.0, 4000.0
    told = check(sped(SOUND["step"], speed))
    assert any(f"segment 0 at tick {min(row, 700)} is " in one and "(and 1 more)" in one for one in told)


@pytest.mark.parametrize("row, rows", [(388, 1), (388, 3), (501, 2), (501, 3), (700, 1), (700, 2)])
def test_speeds_that_go_back_while_the_voltage_stays_are_told(row, rows):
    """As an encoder gives them that was read late: 1.5 times the speed and more, in one row to three, where the voltage
    has changed (row 501), too."""
    volts = np.repeat([0.0, 5.0, 9.0, 5.0], [200, 301, 300, 199])
    speed = motor(volts, pole=0.2)
    assert spikes(sped(volts, speed)) == []
    speed[row : row + rows] = 1.5 * np.abs(speed).max()
    assert spikes(sped(volts, speed)) == [(0, row, rows)]
    [told] = [one for one in check(sped(volts, speed)) if "no motor does that" in one]
    lasts = {1: "that row only", 2: "that row and the next only", 3: "that row and the next 2 only"}[rows]
    assert f"at tick {row} is {speed[row]:.4g} rad/s, for {lasts}: " in told


def test_speeds_between_lost_rows_are_no_spikes():
    """Where the same voltage stands before and after, another one may have been applied meanwhile."""
    volts, speed = np.full(1000, 5.0), np.full(1000, 40.0)
    speed[450:452] = 70.0
    assert spikes(sped(volts, speed)) == [(0, 450, 2)]
    kept = np.delete(np.arange(1000), [*range(440, 450), *range(452, 460)])
    assert spikes(from_arrays(time_s=0.01 * kept, volts=volts[kept], speed_rad_s=speed[kept])) == []


def test_speeds_that_stay_are_no_spikes():
    """A load that is taken off, a step in few rows, a reading that swings for long."""
    volts = np.full(1000, 5.0)
    loaded = np.where(np.arange(1000) < 400, 30.0, 50.0)
    swings = 40.0 + np.where(np.arange(1000) < 400, 20 * np.cos(np.arange(1000) * 0.9), 0.0)
    for speed in (loaded, np.minimum(loaded, loaded[::-1]), swings):
        assert spikes(sped(volts, speed)) == []


@pytest.mark.parametrize("pole", [0.02, 0.2, 1.0, 3.0])
@pytest.mark.parametrize("volts", SOUND.values(), ids=SOUND)
def test_sound_angles_have_no_spikes(volts, pole):
    for friction in (0.0, 1.0):
        angle = 0.01 * np.cumsum(motor(volts, pole=pole, friction=friction))
        for step in (1e-9, 0.06):
            assert spikes(angled(step * np.round(angle / step), volts)) == []


@pytest.mark.parametrize("row", [2, 388, 1997])
def test_an_angle_of_one_row_that_no_motor_has_is_told(row):
    angle = 0.01 * np.cumsum(motor(SOUND["step"]))
    assert not any("for that row only" in sentence for sentence in check(angled(angle, SOUND["step"])))
    angle[row] += 40.0
    told = [one for one in check(angled(angle, SOUND["step"])) if "for that row only" in one]
    assert len(told) == 1 and "lost reading" in told[0]
    assert f"the angle of segment 0 at time_s {0.01 * row:g} is " in told[0]


def test_volts_beyond_the_supply_are_told():
    volts = SOUND["sine"]
    most = float(np.abs(volts).max())
    beyond = int((np.abs(volts) > 1.1 * 0.5 * most).sum())
    [told] = warn_beyond_supply(spun(motor(volts), volts, supply_V=0.5 * most))
    assert told.startswith(f"{beyond} of {len(volts)} rows ask for more than the supply, up to {most:.4g} of ")
    assert told in check(spun(motor(volts), volts, supply_V=0.5 * most))
    for supply_V in (most, 0.95 * most, None):
        assert warn_beyond_supply(spun(motor(volts), volts, supply_V=supply_V)) == []


def test_rows_that_a_computer_received_in_bunches_are_told():
    volts, rng = SOUND["sine"][:1000], np.random.default_rng(1)
    even = 0.01 * np.arange(1000.0)
    bunched = np.repeat(even[5::6][: 1000 // 6], 6) + np.tile(2e-4 * np.arange(6), 1000 // 6)
    bunched = bunched + 1e-4 * rng.uniform(size=len(bunched))
    rows = len(bunched)
    events = np.cumsum(np.where(np.arange(rows) < rows // 2, 0.03, 1e-3))

    def stamped(time_s):
        return from_arrays(time_s=time_s, volts=volts[:rows], angle_rad=0.1 * np.arange(rows))

    [told] = warn_bunches(stamped(bunched))
    assert "--period 0.01 " in told and told in check(stamped(bunched))
    for sound in (even[:rows], even[:rows] + 1e-3 * rng.uniform(size=rows), events):
        assert warn_bunches(stamped(sound)) == []


def test_lost_ticks_are_no_jump():
    whole = moved(SOUND["step"], gain=50.0)
    kept = np.r_[0:1000, 1900:2000]
    segment = whole.segments[0]
    gap = dataclasses.replace(
        segment, **{name: getattr(segment, name)[kept] for name in ("tick", "time_s", "volts", "count")}
    )
    recording = dataclasses.replace(whole, segments=(gap,))
    check_jumps(recording)
    assert lost_ticks(gap) == 900
    assert "segment 0: lost 900 of 2000 ticks" in warn_lost_ticks(recording)[0]
    assert warn_lost_ticks(whole) == []


def angled(angle_rad, volts):
    time_s = np.arange(len(volts)) * 0.01
    segment = Segment("other", 0.0, False, {}, time_s, volts, angle_rad=angle_rad)
    return Recording((segment,), "made.csv", supply_V=12.0)


def spun(speed_rad_s, volts, **fields):
    time_s = np.arange(len(volts)) * 0.01
    segment = Segment("other", 0.0, False, {}, time_s, volts, speed_rad_s=speed_rad_s)
    return Recording((segment,), "made.csv", **fields)


def test_angle_within_one_turn():
    volts = SOUND["step"]
    angle = np.cumsum(motor(volts, gain=0.005))
    check_jumps(angled(angle, volts))
    with pytest.raises(RecordingError, match=r"one turn in segment 0 at time_s .*--wrap turn"):
        check_jumps(angled(angle % (2 * np.pi), volts))


def test_there_must_be_an_input():
    for at_rest in (True, False):
        with pytest.raises(RecordingError, match="the input is 0 V throughout"):
            check_input(counted(np.zeros(2000), SOUND["sine"], at_rest=at_rest))
        check_input(counted(np.full(2000, 3.0), SOUND["step"], at_rest=at_rest))


def test_motor_must_move():
    flicker = (TICKS % 7 == 0).astype(np.int64)
    for count in (np.zeros(2000, dtype=np.int64), flicker):
        with pytest.raises(RecordingError, match="the motor never moved"):
            check_output(with_count(moved(SOUND["step"]), count))
    check_output(with_count(moved(SOUND["step"]), flicker * 2))
    with pytest.raises(RecordingError, match="the motor never moved"):
        check_output(angled(np.full(2000, 0.3), SOUND["step"]))
    with pytest.raises(RecordingError, match="the motor never moved"):
        check_output(spun(np.zeros(2000), SOUND["step"]))
    with pytest.raises(RecordingError, match="the speed never changes"):
        check_output(spun(np.full(2000, 4.0), SOUND["step"]))


def sine(**parameters):
    return moved(SOUND["sine"]), {"kind": "sine", "parameters": parameters}


@pytest.mark.parametrize(
    "parameters, reason",
    [
        ({}, "segment 0 is a sine without frequency"),
        ({"frequency_Hz": [1.0]}, "without frequency"),
        ({"frequency_Hz": 100.0}, "not below the Nyquist frequency of 100 Hz"),
    ],
)
def test_impossible_sines(parameters, reason):
    with pytest.raises(RecordingError, match=reason):
        check_sines(counted(SOUND["sine"], SOUND["sine"], kind="sine", parameters=parameters))
    check_sines(counted(SOUND["sine"], SOUND["sine"], kind="sine", parameters={"frequency_Hz": 99.9}))


def test_nyquist_of_logged_time():
    recording = spun(SOUND["sine"], SOUND["sine"])
    fast = dataclasses.replace(recording.segments[0], kind="sine", parameters={"frequency_Hz": 51.0})
    with pytest.raises(RecordingError, match="50 Hz"):
        check_sines(dataclasses.replace(recording, segments=(fast,)))


@pytest.mark.parametrize(
    "frequency, repeats", [(5.0, True), (1, True), (5.005, False), (5.05, False), (0.1, False), (12.5, True)]
)
def test_whole_hertz_sines_repeat_the_encoder(frequency, repeats):
    volts = 6.0 * np.sin(2 * np.pi * frequency * TICKS[:1000] * 0.005)
    warnings = warn_repetition(counted(volts, motor(volts), kind="sine", parameters={"frequency_Hz": frequency}))
    assert bool(warnings) == repeats
    if repeats:
        assert "segment 0: " in warnings[0] and f"Hz for {frequency:g} Hz" in warnings[0]


@given(st.integers(1, 40), st.floats(0.001, 0.01), st.integers(100, 4000))
def test_detuned_sines_do_not_repeat(hertz, detuning, rows):
    volts = np.zeros(rows)
    for frequency in (hertz * (1 + detuning), hertz * (1 - detuning)):
        recording = counted(volts, volts, kind="sine", parameters={"frequency_Hz": frequency})
        if round(detuning, 4) != detuning:
            assert warn_repetition(recording) == []


def test_saturation():
    text = TEXT.replace("0,1,27,0", "0,1,-255,0")
    assert "segment 0 in 33% of its rows" in warn_saturation(parse(text.encode(), "m1.csv"))[0]
    assert warn_saturation(parse(TEXT.encode(), "m1.csv")) == []
    clipped = counted(np.clip(24 * np.sin(TICKS * 0.1), -12, 12), TICKS * 1.0, kind="sine")
    assert "segment 0" in warn_saturation(clipped)[0]


def test_overlapping_segments():
    assert warn_overlap(parse(TEXT.encode(), "m1.csv")) == []
    early = parse(TEXT.replace("start_s = 4.0", "start_s = 0.001").encode(), "m1.csv")
    assert "segment 1: begins before" in warn_overlap(early)[0]


def test_sign():
    recording = moved(SOUND["steps"])
    assert warn_sign(recording) == []
    assert "against the voltage" in warn_sign(with_count(recording, -recording.segments[0].count))[0]
    steps, size = with_count(recording, np.cumsum(np.abs(np.diff(recording.segments[0].count, prepend=0)))), 4.0
    assert "speeds have no sign" in warn_sign(steps)[0]
    one_way = np.where(SOUND["steps"] > 0, size, 0.0)
    assert warn_sign(moved(one_way)) == []
    assert warn_sign(moved(np.where(one_way, one_way, -0.2), friction=0.5)) == []


@pytest.mark.parametrize("name", ["steps", "sine", "PRBS", "chirp"])
def test_inputs_without_their_sign(name):
    """A program that prints the PWM and keeps the direction for itself."""
    recording = moved(SOUND[name], friction=0.3)
    for sign in (1.0, -1.0):
        sizes = dataclasses.replace(recording.segments[0], volts=sign * np.abs(SOUND[name]))
        assert "seem to be sizes" in warn_sign(dataclasses.replace(recording, segments=(sizes,)))[0]
    one_way = moved(np.maximum(SOUND[name], 0.0), friction=0.3)
    assert warn_sign(one_way) == []


def test_a_shaft_that_swings_back_is_no_lost_sign():
    """A load on a spring, at a voltage that is switched on once; and one that turns back while nothing drives it."""
    swing = 30 * np.cos(0.1 * TICKS) * np.exp(-0.01 * TICKS)
    assert warn_sign(spun(swing[:1500], np.full(1500, 6.0))) == []
    back = np.where(TICKS % 400 < 200, 20.0, -10.0)
    assert warn_sign(spun(back, np.where(TICKS % 400 < 200, 6.0, 0.0))) == []


def test_a_shaft_that_moves_before_it_is_driven():
    """Where rows hold the input that was applied until them; a fast motor that is read half a row late is no such."""
    volts = np.where(np.arange(200) < 100, 0.0, 6.0)
    speed = 30 * (1 - np.exp(-np.maximum(np.arange(200) - 100.0, 0) * 2.0))
    assert speed[100] == 0 and speed[101] > 0.8 * speed.max()
    for shifted, is_early in ((speed, False), (np.append(speed[1:], speed[-1]), True)):
        assert bool(warn_early(spun(shifted, volts))) == is_early
        assert bool(warn_early(angled(np.cumsum(shifted) * 0.01, volts))) == is_early
    off = np.cumsum(speed) * 0.01
    off[99] -= 0.5
    assert warn_early(angled(off, volts)) == []
    wrong = sped(
        volts, np.where((np.arange(200) == 100) | (np.arange(200) == 101), 60.0, 30 - 20 * 0.9 ** np.arange(200))
    )
    wrong.segments[0].shaft[:100] = 0.0
    assert warn_early(wrong) == [] and spikes(wrong) == [(0, 100, 2)]
    kept = np.delete(np.arange(200), [100, 101])
    lost = from_arrays(time_s=0.01 * kept, volts=volts[kept], speed_rad_s=speed[kept])
    assert speed[102] > 0.9 * speed.max() and warn_early(lost) == []
    half_late = speed + np.where(np.arange(200) == 100, 12.0, 0.0)
    coasting = speed[::-1]
    for sound in (half_late, coasting, np.full(200, 30.0)):
        assert warn_early(spun(sound, volts)) == []
    assert not any(warn_early(moved(plan)) for plan in SOUND.values())


def test_a_shaft_that_turns_on_steadily_without_an_input():
    """A log of what was added to a constant input; no coasting wheel, no swinging load and no rest is one."""
    volts = np.where((np.arange(600) < 200) | (np.arange(600) >= 400), 0.0, 3.0)
    fall = 0.9 ** np.arange(200)
    follows = np.concatenate([np.zeros(200), 1 - fall, fall])
    noise = np.random.default_rng(1).normal(0, 0.3, 600)
    [told] = warn_zero(spun(30 + 20 * follows + noise, volts))
    assert told.startswith(AT_ZERO) and "a steady 30" in told and "for 2 s:" in told and "COL:duty:FULL@ZERO" in told
    assert told in check(spun(30 + 20 * follows + noise, volts))
    falling = 50 * 0.999 ** np.arange(200)
    coasting = np.concatenate([falling, np.full(200, 50.0), falling])
    swinging = np.where(volts > 0, 50.0, 30 * np.cos(0.02 * np.arange(600)))
    for sound in (20 * follows, coasting, swinging, np.zeros(600)):
        assert warn_zero(spun(sound + noise, volts)) == []
    assert warn_zero(spun(np.full(600, 30.0), np.zeros(600))) == []
    assert not any(warn_zero(moved(plan)) for plan in SOUND.values())


def test_unknowns():
    named = " ".join(warn_unknowns(spun(SOUND["sine"], SOUND["sine"])))
    assert "speed_window_s" in named and "supply_V" in named
    assert warn_unknowns(spun(SOUND["sine"], SOUND["sine"], speed_window_s=0.0, supply_V=12.0)) == []


def test_check_gathers_all():
    text = TEXT.replace("start_s = 4.0", "start_s = 0.001")
    warnings = check(parse(text.encode(), "m1.csv"))
    assert any("lost 1 of 3 ticks" in sentence for sentence in warnings)
    assert any("begins before" in sentence for sentence in warnings)
    assert not any("m1.csv" in sentence for sentence in warnings)


def test_one_sentence_names_all_its_segments():
    volts = 6.0 * np.sin(2 * np.pi * 5 * TICKS[:1000] * 0.005)
    one = counted(volts, motor(volts), kind="sine", parameters={"frequency_Hz": 5.0})
    odd = dataclasses.replace(one.segments[0], parameters={"frequency_Hz": 5.003})
    many = dataclasses.replace(one, segments=(*one.segments * 3, odd, *one.segments))
    assert [sentence.split(":")[0] for sentence in warn_repetition(many)] == ["segments 0-2, 4"]


def test_speeds_over_rows_of_unknown_length_are_refused():
    with pytest.raises(RecordingError, match="speed_window_rows needs speed_window_s"):
        check(spun(SOUND["sine"], SOUND["sine"], speed_window_rows=5))


def test_what_hardly_turns_does_not_move():
    with pytest.raises(RecordingError, match="never moved"):
        check(spun(1e-200 * SOUND["sine"], SOUND["sine"]))
