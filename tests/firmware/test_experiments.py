"""Each experiment's duties against the reference, integer by integer."""

import numpy as np
import pytest
from testing import reference
from testing.wire import Script, hertz, level

from jaxmotor.bench import experiment_volts
from jaxmotor.bench._plan import parse_plan

CASES = [
    ("step", 60, 0, level(-125.4), 0),
    ("step", 60, 0, level(250), 0),
    ("ramp", 999, 0, level(-250), level(250)),
    ("ramp", 400, 0, level(50), level(-20.5)),
    ("sine", 500, hertz(9.97, 0.005), level(172.3), 0),
    ("sine", 500, hertz(0.3, 0.005), level(-30.7), level(100.4)),
    ("multisine", 600, hertz(0.5, 0.005), level(40), 8 + (2 << 8)),
    ("multisine", 200, hertz(1, 0.005), level(250), 3 + (1 << 8)),
    ("chirp", 800, hertz(0.2, 0.005), hertz(15, 0.005) // 800, level(150)),
    ("chirp", 300, hertz(15, 0.005), -(hertz(14, 0.005) // 300), level(150)),
    ("prbs", 700, 7 + (4 << 8), level(120), level(10)),
    ("prbs", 300, 15 + (1 << 8), level(60.5), 0),
    ("rest", 30, 0, 0, 0),
]


@pytest.mark.parametrize(("kind", "ticks", "a", "b", "c"), CASES)
def test_duties(bench, kind, ticks, a, b, c):
    outcome = bench(bytes(Script().add(kind, ticks, a, b, c).go()))
    samples = outcome.samples(0)
    assert [tick for tick, _, _ in samples] == list(range(ticks))
    assert [duty for _, duty, _ in samples] == reference.EXPERIMENTS[kind](ticks, a, b, c)


@pytest.mark.parametrize(
    ("kp", "ki", "ref"), [(28 * 256, 0, 16 * 19), (10 * 256, 900, 16 * 19), (65535, 65535, -16384), (3000, 2000, 500)]
)
@pytest.mark.parametrize("period", [1, 5, 20])
def test_speed_loop(bench, kp, ki, ref, period):
    script = Script().command("U 500000").command(f"P {period} 0").add("loop", 300, kp + (ki << 16), ref, rest=10).go()
    outcome = bench(bytes(script))
    counts = [count for _, _, count in outcome.samples(0)[-1:] + outcome.samples(1)]
    duties = [duty for _, duty, _ in outcome.samples(1)]
    assert duties == reference.loop(counts, kp + (ki << 16), ref)
    assert len(set(duties)) > 3 or abs(duties[-1]) == 250


def test_every_register_order_is_as_long_as_it_can_be():
    for order in reference.PRBS_TAPS:
        length = 2**order - 1
        duties = reference.prbs(2 * length, order + 256, 128, 0)
        assert duties[:length] == duties[length:]
        assert sum(duties[:length]) == 1
        assert all(duties[:length] != duties[k : k + length] for k in (1, 3, length // 3, length // 7))


def test_a_sine_is_a_sine():
    import math

    duties = reference.sine_wave(1000, hertz(3.01, 0.005), level(200), 0)
    exact = [200 * math.sin(2 * math.pi * 3.01 * 0.005 * k) for k in range(1000)]
    assert max(abs(a - b) for a, b in zip(duties, exact, strict=True)) < 0.53


@pytest.mark.parametrize(("first", "tones", "stride"), [(5, 6, 2), (3, 8, 1), (40, 3, 5)])
def test_a_multisine_has_its_tones_where_it_says(first, tones, stride):
    """1024 ticks, `first` periods of the first tone: each tone falls on a line of the spectrum of its own."""
    duties = np.array(reference.multisine(1024, first * 2**22, level(20), tones + (stride << 8)))
    lines = np.abs(np.fft.rfft(duties)) / 512
    stated = [first * (1 + j * stride) for j in range(tones)]
    np.testing.assert_allclose(lines[stated], 20, atol=0.15)
    assert np.delete(lines, stated).max() < 0.15  # rounding to whole duties


def test_a_multisine_is_what_simulations_take_it_for():
    """Both are written from docs/protocol.md; the board's table of sines and whole duties differ by less than one."""
    plan = parse_plan(
        """
        period_ms = 5
        [[experiment]]
        kind = "multisine"
        first_Hz = 0.7
        tones = 5
        stride = 3
        amplitude_V = 0.9
        duration_s = 3
        """,
        "here",
    )
    duties = reference.multisine(600, hertz(0.7, 0.005), level(0.9 / 7.4 * reference.FULL_SCALE), 5 + (3 << 8))
    wanted = experiment_volts(plan, 0, 7.4) / 7.4 * reference.FULL_SCALE
    assert np.abs(duties - wanted).max() < 0.6


def test_segments_follow_each_other_without_a_lost_tick(bench):
    script = Script().add("step", 20, b=level(100), rest=30).add("sine", 25, hertz(5, 0.005), level(90))
    outcome = bench(bytes(script.add("rest", 10).add("step", 15, b=level(-40), rest=2).go()))
    begins = [line.fields for line in outcome.of("B")]
    assert begins == [
        ("0", "0", "rest", "0", "30"),
        ("1", "0", "step", "30", "20"),
        ("2", "1", "sine", "50", "25"),
        ("3", "2", "rest", "75", "10"),
        ("4", "3", "rest", "85", "2"),
        ("5", "3", "step", "87", "15"),
    ]
    order = [(line.type, int(line.fields[0])) for line in outcome.lines if line.type in "BDE"]
    for segment, (_, _, _, _, ticks) in enumerate(begins):
        block = [("B", segment)] + [("D", segment)] * int(ticks) + [("E", segment)]
        assert order[: len(block)] == block
        order = order[len(block) :]
    assert outcome.of("Z")[0].fields == ("done", "102", "0", "0")
    assert outcome.lines[-1].type == "Z"


def test_supply_comes_every_tenth_of_a_second(bench):
    outcome = bench(bytes(Script().command("P 10 0").add("rest", 100).go()))
    with_supply = [k for k, line in enumerate(outcome.of("D")) if len(line.fields) == 5]
    assert with_supply == list(range(9, 100, 10))
    assert all(abs(int(outcome.of("D")[k].fields[4]) - 7400) < 25 for k in with_supply)
