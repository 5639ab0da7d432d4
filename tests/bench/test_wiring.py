"""The wiring check: what two pulses tell."""

import pytest
from boards import BOARD

from jaxmotor.bench import Port, RecorderError, parse_plan, record
from jaxmotor.bench._slots import Rig
from jaxmotor.bench._wiring import Pulse, wiring_faults, wiring_notes

RIG = Rig(BOARD, 5, 7.4, 617.4)
FORWARD, BACKWARD = Pulse((0, 40, 300, 380), 4000.0), Pulse((380, 340, 80, 0), -4000.0)
STILL, FLICKER = Pulse((5, 5, 5)), Pulse((5, 6, 5, 6))
STEP = '[[experiment]]\nkind = "step"\namplitude_V = 5\nduration_s = 0.2\n'


@pytest.mark.parametrize(
    ("forward", "backward", "said"),
    [
        (STILL, STILL, "encoder is dead"),
        (FLICKER, FLICKER, "one of the encoder's two phases is missing"),
        (BACKWARD, FORWARD, "swap"),
        (FORWARD, STILL, "backward"),
        (STILL, BACKWARD, "forward"),
        (FORWARD, FORWARD, "same way"),
    ],
)
def test_faults_have_names(forward, backward, said):
    [fault] = wiring_faults(forward, backward)
    assert said in fault


def test_a_sound_rig_has_no_fault():
    assert not list(wiring_faults(FORWARD, BACKWARD))
    assert not list(wiring_notes(FORWARD, BACKWARD, 0, RIG, 4.4, None))


@pytest.mark.parametrize("factor", [4, 2, 0.5, 0.25])
def test_wrong_counts_per_turn_show_against_the_data_sheet(factor):
    no_load = 4000 * 7.4 / 4.4 / 617.4 * 6.2832 / factor
    [note] = wiring_notes(FORWARD, BACKWARD, 0, RIG, 4.4, no_load)
    assert f"{factor:g} times" in note and "counts_per_rev" in note


def test_noise_on_the_encoder_is_noted():
    [note] = wiring_notes(FORWARD, BACKWARD, 3, RIG, 4.4, None)
    assert "illegal" in note


@pytest.mark.parametrize(
    ("wiring", "said"),
    [
        ("wiring.motor_swapped=true", "swap"),
        ("wiring.encoder_swapped=true", "swap"),
        ("wiring.unplugged_at_s=0", "encoder is dead"),
        ("wiring.jammed_at_s=0", "stood still"),
    ],
)
def test_a_miswired_board_is_found_out(emulator, tmp_path, wiring, said):
    with pytest.raises(RecorderError, match=said):
        record(parse_plan(STEP, "p"), lambda: Port("emulated", options=("--set", wiring)), tmp_path / "r.csv")
    assert not list(tmp_path.iterdir())


def test_both_swapped_looks_right(emulator, tmp_path):
    """Only a look at the shaft could tell."""
    options = ("--set", "wiring.motor_swapped=true", "--set", "wiring.encoder_swapped=true")
    made = record(parse_plan(STEP, "p"), lambda: Port("emulated", options=options), tmp_path / "r.csv")
    step = next(segment for segment in made.segments if segment.kind == "step")
    assert step.volts[-1] * (step.count[-1] - step.count[0]) > 0
