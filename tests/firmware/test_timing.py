"""What the comments promise in cycles, measured on the processor; 16 cycles are 1 us."""

import itertools
import re

import pytest
from testing.wire import Script, hertz, level

# 7.4 V x 10.6 rad/s/V = 12.5 rev/s, so 10 kHz of edges
FAST_ENCODER = "[encoder]\ncounts_per_rev = 805\n"


@pytest.fixture
def promised(build):
    """The number in a comment, by file and by words before `cycles`."""

    def find(file: str, pattern: str) -> int:
        text = " ".join((build.parent / "motor_rig" / file).read_text().replace("//", " ").split())
        match = re.search(pattern, text)
        assert match, f"{file}: no comment like {pattern}"
        return int(match[1])

    return find


@pytest.fixture
def busy(bench):
    """Everything at once: 1 kHz samples of the longest experiment, 10 kHz of edges, 500000 baud."""
    script = Script().command("U 500000").command("P 1 0")
    script.add("step", 400, b=level(250)).add("multisine", 2000, hertz(0.3, 0.001), level(100), 264)
    script.add("loop", 1000, 2000 + (500 << 16), 16 * 9).add("sine", 1000, hertz(0.5, 0.001), level(250))
    return bench(bytes(script.go()), plant=FAST_ENCODER)


def test_interrupts_keep_their_promise(busy, promised):
    edge = max(busy.stats["encoder_a"]["cycles"], busy.stats["encoder_b"]["cycles"])
    assert edge <= promised("encoder.c", r"One edge\. At most (\d+) cycles")
    assert busy.stats["uart_tx"]["cycles"] <= promised("uart.c", r"One byte out\. At most (\d+) cycles")
    assert busy.stats["uart_rx"]["cycles"] <= promised("uart.c", r"shows\. At most (\d+) cycles")
    assert busy.stats["tick"]["own_cycles"] <= promised("tick.c", r"8 tones: at most (\d+) cycles")


def test_promises_are_not_idle(busy, promised):
    """None is more than a third above what was measured."""
    assert busy.stats["tick"]["own_cycles"] > 0.75 * promised("tick.c", r"8 tones: at most (\d+) cycles")
    assert busy.stats["encoder_a"]["cycles"] > 0.75 * promised("encoder.c", r"One edge\. At most (\d+) cycles")


def test_an_edge_never_waits_for_long(busy, promised):
    blocked = promised("tick.c", r"(\d+) of them with interrupts off")
    wait = max(busy.stats["encoder_a"]["wait_cycles"], busy.stats["encoder_b"]["wait_cycles"])
    assert wait <= blocked < 1600  # the time between edges at 10 kHz


def test_no_sample_and_no_edge_is_lost_at_10_kHz(busy):
    counts = [line.ints()[3] for line in busy.of("D")]
    assert len(counts) == 4400
    assert max(abs(b - a) for a, b in itertools.pairwise(counts)) >= 10  # per ms
    assert busy.of("Z")[0].fields == ("done", "4400", "0", "0")
    # The board counted what the plant turned.
    assert busy.stats["encoder_a"]["calls"] + busy.stats["encoder_b"]["calls"] >= max(counts)


def test_the_counter_ends_where_the_plant_does(bench):
    script = Script().add("sine", 1000, hertz(1.3, 0.005), level(250)).add("rest", 200).go()
    outcome = bench(bytes(script), plant=FAST_ENCODER)
    assert outcome.of("E")[-1].ints(3)[0] == outcome.stats["plant"]["count"]
    assert outcome.of("Z")[0].fields[2] == "0"


def test_the_duty_is_always_set_in_time(busy, promised):
    """Else it would act a PWM period late."""
    [hello] = [line.fields for line in busy.of("H") if line.fields[1] == "2/4"]
    [delay_us] = [int(field.split("=")[1]) for field in hello if field.startswith("duty_delay_us")]
    promise = promised("tick.c", r"at most (\d+) cycles after the timer")
    assert 0 < busy.stats["duty_last_cycle"] <= promise < 16 * delay_us


def test_received_bytes_do_not_overrun(busy):
    """The part holds two bytes while the interrupts are off; at 500000 baud they come every 320 cycles."""
    assert busy.stats["uart_rx"]["wait_cycles"] < 2 * 320


def test_sampling_jitter(busy, bench):
    """The tick waits for an edge or a byte that is being handled, never longer than they take together."""
    assert busy.stats["tick_last_cycle"] - busy.stats["tick_first_cycle"] < 400
    calm = bench(bytes(Script().add("rest", 200).go()))
    assert calm.stats["tick_last_cycle"] - calm.stats["tick_first_cycle"] < 150


def test_stack_and_variables_do_not_meet(busy):
    assert busy.stats["stack_left_bytes"] >= 64
