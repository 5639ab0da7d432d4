"""Rows in which voltages from before an experiment may still act are left out."""

import numpy as np
import pytest

from jaxmotor.prediction import pack, without_transients
from jaxmotor.recording import Recording, Segment

PERIOD_S = 0.01
LATE = 4


def segment(begin_tick: int, ticks: int, volts: float, at_rest: bool, lost: int = 0) -> Segment:
    tick = np.arange(ticks)
    tick[ticks // 2 :] += lost
    return Segment(
        kind="other",
        start_s=begin_tick * PERIOD_S,
        at_rest=at_rest,
        parameters={},
        time_s=tick * PERIOD_S,
        volts=np.full(ticks, volts),
        tick=tick,
        count=3 * tick,
    )


def left_out(*segments: Segment) -> list[tuple[int, int]]:
    """(segment, row) of what is packed, but not observed any more."""
    recording = Recording(segments, "made.csv", period_s=PERIOD_S, counts_per_rev=500.0)
    packed = pack(recording, tuple(range(len(segments))))
    kept = without_transients(recording, packed)
    gone = packed.batch.valid & ~kept.batch.valid
    assert not (kept.batch.valid & ~packed.batch.valid).any()
    return sorted(zip(packed.segment_of[gone].tolist(), packed.row_of[gone].tolist(), strict=True))


def first(index: int, row: int = 0) -> list[tuple[int, int]]:
    return [(index, row + k) for k in range(LATE)]


def test_after_another_voltage_without_a_rest():
    assert left_out(segment(0, 40, 5.0, True), segment(40, 40, 3.0, False)) == first(1)


@pytest.mark.parametrize(
    ("before", "begin", "at_rest"),
    [(0.0, 40, False), (5.0, 40 + LATE + 1, False), (5.0, 40, True)],
    ids=["a rest", "a pause", "at rest"],
)
def test_nothing_after(before, begin, at_rest):
    assert left_out(segment(0, 40, before, True), segment(begin, 40, 3.0, at_rest)) == []


def test_the_first_experiment_has_none_before_it():
    assert left_out(segment(0, 40, 5.0, False)) == []


def test_after_a_lost_tick():
    assert left_out(segment(0, 40, 5.0, True, lost=2)) == first(0, 20)


def test_most_of_a_short_piece_stays():
    gone = left_out(segment(0, 40, 5.0, True), segment(40, 7, 3.0, False))
    assert gone == [(1, 0), (1, 1)]  # of six differences
