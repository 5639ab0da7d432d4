"""Plans: what they say, what is refused, and what they are in the board's numbers."""

import pytest
from boards import BOARD

from jaxmotor.bench import BUILT_IN, PlanError, load_plan, parse_plan
from jaxmotor.bench._board import baud_for
from jaxmotor.bench._slots import layout, rig_for, slots_for

SINE = '[[experiment]]\nkind = "sine"\nfrequency_Hz = 5\namplitude_V = 5.1\nduration_s = 2\n'


def slots(text: str):
    plan = parse_plan(text, "p")
    return slots_for(plan, rig_for(plan, BOARD))


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_plans_run_on_the_board(name):
    plan = load_plan(name)
    assert plan.name == name and len(plan.experiments) <= BOARD.slots
    assert len(slots_for(plan, rig_for(plan, BOARD))) == len(plan.experiments)


def test_the_full_plan_is_enough_to_diagnose():
    plan = load_plan("full")
    kinds = {experiment.kind for experiment in plan.experiments}
    assert 14_000 <= plan.ticks <= 16_000
    assert {"sine", "step", "ramp", "prbs", "closed_loop"} <= kinds
    assert len({e.parameters["amplitude_V"] for e in plan.experiments if e.kind == "sine"}) == 2
    for kind, key in (("step", "amplitude_V"), ("ramp", "to_V"), ("closed_loop", "reference_rad_s")):
        values = [e.parameters[key] for e in plan.experiments if e.kind == kind]
        assert min(values) < 0 < max(values)


def test_sines_are_detuned_unless_whole_hertz():
    stated = [0.5, *range(1, 11)]
    for whole in (False, True):
        plan = load_plan("paper", whole_hertz=whole)
        found = [e.parameters["frequency_Hz"] for e in plan.experiments if e.kind == "sine"]
        shares = [f / s - 1 for f, s in zip(found, stated, strict=True)]
        assert found == stated if whole else all(0.001 < share < 0.005 for share in shares)


def test_lists_and_repeats_become_experiments():
    plan = parse_plan(SINE.replace("5\n", "[1, 2]\n", 1) + "repeat = 3\nrest_s = 0\n", "p")
    assert [e.parameters["frequency_Hz"] for e in plan.experiments] == [1, 1, 1, 2, 2, 2]
    assert plan.ticks == 6 * 400 and plan.seconds == 12


def test_periods_lengthen_slow_sines():
    plan = parse_plan(SINE.replace("5\n", "[0.5, 5]\n", 1) + "periods = 2\n", "p")
    assert [e.ticks for e in plan.experiments] == [800, 400]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no experiments"),
        ("x", "not TOML"),
        ("period_ms = 4.5\n" + SINE, "period_ms"),
        ("periodms = 5\n" + SINE, "periodms is not known"),
        ("drive = 'fast'\n" + SINE, "'brake' or 'coast'"),
        (SINE.replace("sine", "sinus"), "'sinus' is not known"),
        (SINE.replace("frequency_Hz = 5\n", ""), "a sine needs frequency_Hz"),
        (SINE.replace("= 5\n", "= 100\n"), "Nyquist"),
        (SINE.replace("= 5\n", "= []\n"), "empty list"),
        (SINE.replace("duration_s = 2\n", ""), "duration_s"),
        (SINE.replace("duration_s = 2", "duration_s = 0.005"), "less than two samples"),
        (SINE.replace("duration_s = 2", "duration_s = 1e4"), "split it"),
        (SINE.replace("= 5.1", "= true"), "is not a number"),
        (SINE.replace("= 5.1", "= 0"), "amplitude_V is 0"),
        (SINE + "phase = 1\n", "phase is not known"),
        (SINE + "repeat = 0\n", "repeat"),
        ("supply_V = -7\n" + SINE, "not positive"),
        (SINE.replace("= 5.1", "= 9"), "9 V are more than the supply of 7.4 V"),
        (SINE + "offset_V = 4\n", "more than the supply"),
        ('[[experiment]]\nkind = "prbs"\namplitude_V = 3\norder = 8\nduration_s = 2\n', "order = 8"),
        ('[[experiment]]\nkind = "closed_loop"\nreference_rad_s = 1e4\ngain = 0.4\nduration_s = 2\n', "reference"),
        ('[[experiment]]\nkind = "closed_loop"\nreference_rad_s = 9\ngain = 40\nduration_s = 2\n', "gain"),
        ("period_ms = 0\n" + SINE, "period_ms"),
    ],
)
def test_what_cannot_run_is_a_sentence(text, said):
    with pytest.raises(PlanError, match=r"p[:,] ") as caught:
        slots(text)
    assert said in str(caught.value)


def test_a_plan_that_is_not_there():
    with pytest.raises(PlanError, match="paper and full"):
        load_plan("paperr")


def test_numbers_are_the_boards():
    [slot] = slots(SINE)
    assert (slot.kind, slot.rest, slot.ticks) == ("sine", 60, 400)
    assert slot.numbers == (round(0.025 * 2**32), round(5.1 / 7.4 * 250 * 128), 0)
    assert slot.header["frequency_Hz"] == pytest.approx(5, rel=1e-7)


def test_the_header_says_what_the_whole_numbers_are():
    text = (
        '[[experiment]]\nkind = "closed_loop"\nreference_rad_s = 37.7\ngain = 0.4\nintegral_gain = 2\nduration_s = 1\n'
    )
    [slot] = slots(text)
    kp, ki = slot.numbers[0] & 0xFFFF, slot.numbers[0] >> 16
    per_duty, per_tick = 7.4 / 250, 617.4 * 0.005 / 6.283185307179586
    assert slot.header["gain"] == pytest.approx(kp / 256 * per_tick * per_duty)
    assert slot.header["integral_gain"] == pytest.approx(ki / 65536 * per_tick / 0.005 * per_duty)
    assert slot.header["gain"] == pytest.approx(0.4, rel=1e-3) and slot.header["integral_gain"] == pytest.approx(
        2, rel=1e-3
    )
    assert slot.header["reference_rad_s"] == pytest.approx(37.7, rel=2e-3)


def test_rests_are_segments_of_their_own():
    plan = parse_plan(SINE + "repeat = 2\n", "p")
    planned = layout(slots_for(plan, rig_for(plan, BOARD)), ["sine", "sine"])
    assert [(p.slot, p.kind, p.ticks, p.is_rest_before) for p in planned] == [
        (0, "rest", 60, True),
        (0, "sine", 400, False),
        (1, "rest", 60, True),
        (1, "sine", 400, False),
    ]


def test_fast_sampling_takes_a_fast_line():
    assert baud_for(5, 115200) == 115200
    assert baud_for(1, 115200) == 500000
    assert baud_for(5, 1000000) == 1000000
