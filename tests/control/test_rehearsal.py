"""A plan on a model: as the plant library would record it, and a recording like any other."""

import numpy as np
import pytest
from models import HARDWARE, model
from testing import reference as board_waves
from testing.plant import Plant

from jaxmotor import JaxmotorError, identify, read
from jaxmotor.bench import load_plan, parse_plan
from jaxmotor.control import Hardware, simulate_plan
from jaxmotor.recording import write

FRICTION = (("coulomb_friction", {"volts_V": 0.3}), ("dead_zone", {"volts_V": 0.2}))
PLAN = """
period_ms = 5
[[experiment]]
kind = "sine"
frequency_Hz = 2.006
amplitude_V = 5.0
duration_s = 1
[[experiment]]
kind = "prbs"
amplitude_V = 4.0
duration_s = 1
[[experiment]]
kind = "ramp"
from_V = 0
to_V = 5
duration_s = 1
[[experiment]]
kind = "chirp"
from_Hz = 1
to_Hz = 8
amplitude_V = 4
duration_s = 1
[[experiment]]
kind = "closed_loop"
reference_rad_s = 37.7
gain = 0.4
duration_s = 1
"""


@pytest.fixture(scope="module")
def recording():
    return simulate_plan(model(*FRICTION), parse_plan(PLAN, "mine.toml"), HARDWARE)


def test_the_plant_counts_the_same(plant_library, recording):
    duty = np.concatenate([segment.duty for segment in recording.segments])
    count = np.concatenate([segment.count for segment in recording.segments])
    toml = "[motor]\ninductance_H = 0\n[encoder]\nstart_fraction = 0.5\n[bench]\npwm_edges = false\n"
    toml += "[coulomb_friction]\nvolts_V = 0.3\n[dead_zone]\nvolts_V = 0.2\n"
    with Plant(toml) as plant:
        run = plant.sequence(duty, period_s=0.005, delay_s=40e-6)
    assert np.abs(np.diff(count) - np.diff(run.count)).max() <= 1
    assert abs((count[-1] - count[0]) - (run.count[-1] - run.count[0])) <= 3 and abs(int(count[-1])) > 500


def test_the_loop_is_the_boards(plant_library, recording):
    """The last segment's own duties, from a plant that is driven by the board's integer law."""
    loop = recording.segments[-1]
    gain = round(256 * 0.4 / HARDWARE.step_V / HARDWARE.counts_per_tick)
    toml = "[motor]\ninductance_H = 0\n[coulomb_friction]\nvolts_V = 0.3\n[dead_zone]\nvolts_V = 0.2\n"
    with Plant(toml) as plant:
        reference = np.full(len(loop), round(16 * 37.7 * HARDWARE.counts_per_tick))
        run = plant.loop(reference, gain, period_s=0.005, delay_s=40e-6)
    turned = [int(c[-1] - c[0]) for c in (loop.count, run.count)]
    assert turned[0] == pytest.approx(turned[1], rel=0.01) and loop.duty[0] == run.duty[0] == 250


def test_the_wave_is_the_boards(recording):
    """Against the second writing of the firmware's integers, within a duty."""
    board = {kind: next(s for s in recording.segments if s.kind == kind) for kind in ("sine", "prbs", "ramp", "chirp")}
    level = [round(volts / HARDWARE.step_V * 128) for volts in (4.0, 5.0)]
    hertz = [round(frequency * 0.005 * 2**32) for frequency in (2.006, 1, 8)]
    expected = {
        "sine": board_waves.sine_wave(200, hertz[0], level[1], 0),
        "prbs": board_waves.prbs(200, 9 + (4 << 8), level[0], 0),
        "ramp": board_waves.ramp(200, 0, 0, level[1]),
        "chirp": board_waves.chirp(200, hertz[1], round((hertz[2] - hertz[1]) / 200), level[0]),
    }
    for kind, segment in board.items():
        assert np.abs(segment.duty - np.array(expected[kind])).max() <= 1, kind


def test_it_is_a_recording_that_can_be_identified(tmp_path):
    made = simulate_plan(model(gain=9.0, pole=25.0), load_plan("paper"), HARDWARE, seed=3)
    write(made, tmp_path / "made.csv")
    fit = identify(read(tmp_path / "made.csv"))
    assert abs(float(fit.motor.gain) - 9.0) < 3 * float(fit.standard_error.gain)
    assert abs(float(fit.motor.pole) - 25.0) < 3 * float(fit.standard_error.pole)


def test_what_does_not_fit_is_a_sentence():
    with pytest.raises(JaxmotorError, match="not the rig's"):
        simulate_plan(model(), parse_plan(PLAN, "mine.toml"), Hardware(0.004, 617.4, 7.4))
    with pytest.raises(JaxmotorError, match="more than the supply"):
        simulate_plan(model(), parse_plan(PLAN, "mine.toml"), Hardware(0.005, 617.4, 4.5))
