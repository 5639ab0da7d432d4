"""The account of a recording: each planned tick came, was lost, was left out on request, or never ran."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_decoder import seal

from jaxmotor.bench import Decoder, parse_plan
from jaxmotor.bench._account import missing, tallies
from jaxmotor.bench._journal import new_run
from jaxmotor.bench._slots import Rig

from boards import BOARD  # isort: skip

PLAN = parse_plan(
    'rest_s = 0.1\n[[experiment]]\nkind = "step"\namplitude_V = [5, -4, 3]\nduration_s = 0.3\n', "account"
)
SEGMENTS = [ticks for each in PLAN.experiments for ticks in (each.rest_ticks, each.ticks)]


def lines_of(ran, reason, run=9):
    """What a board says of a run whose segments ran for `ran` ticks; where to find Z; and its answers to Q and R."""
    texts, start = [], 0
    for segment, ticks in enumerate(ran):
        kind = "step" if segment % 2 else "rest"
        texts.append(f"B # {run} {segment} {segment // 2} {kind} {start} {SEGMENTS[segment]}")
        texts += [f"D # {segment} {tick} 100 {start + tick}" for tick in range(ticks)]
        last = segment == len(ran) - 1
        word = "done" if ticks == SEGMENTS[segment] else reason if last and reason != "done" else "skipped"
        texts.append(f"E # {run} {segment} {word} {ticks} 0 0 0")
        start += ticks
    texts.append(f"Z # {run} {reason} {start} 0 0")
    padded = [*ran, *[0] * (6 - len(ran))]
    asked = [f"Q # 90 {run} {reason} {start} 3 0 0 7380 0 0", f"R # 91 {run} 0 {' '.join(map(str, padded))}"]
    return [seal(text.replace("#", str(number + 5))) for number, text in enumerate(texts + asked)]


def received(lines):
    run = new_run(PLAN, Rig(BOARD, 5, 7.4, 617.4), [0, 1, 2], 7400, None, 0, 9)
    for message in Decoder().feed(b"".join(lines)):
        run.log.feed(message)
    return run


FULL = lines_of(SEGMENTS, "done")
RUNS = {"done": SEGMENTS, "stalled": [20, 60, 20, 31], "time_limit": [20, 60, 7]}


@given(
    st.sampled_from(sorted(RUNS)),
    st.lists(st.sampled_from(["keep", "keep", "keep", "lose"]), min_size=300, max_size=300),
    st.integers(0, 59),
)
def test_every_planned_tick_is_accounted_for_whatever_is_lost(reason, fate, skipped_at):
    """The answers to Q and R come, as they do when asked again and again."""
    ran = list(RUNS[reason])
    if reason == "done":
        ran[1] = 60 - skipped_at
    lines = lines_of(ran, reason)
    kept = [line for line, what in zip(lines[:-2], fate, strict=False) if what == "keep"]
    run = received(kept + lines[-2:])
    rows = [line for line in kept if line.startswith(b"D")]
    assert run.log.accounted
    found = tallies(PLAN, [run])
    assert sum(tally.rows for tally in found) == len(rows)
    for tally, (rest, step) in zip(found, zip(*[iter([*ran, *[0] * (6 - len(ran))])] * 2, strict=True), strict=True):
        assert tally.rows + tally.lost == rest + step
        assert tally.planned == tally.rows + tally.lost + tally.skipped + tally.not_run and not tally.unknown
        assert tally.whole == (tally.lost == tally.not_run == 0)
    assert (missing(found) == "") == all(tally.whole for tally in found)


def test_a_whole_run_lacks_nothing():
    run = received(FULL[:-2])
    assert run.log.accounted and run.done == {0, 1, 2} and missing(tallies(PLAN, [run])) == ""


def test_an_experiment_of_which_nothing_came_is_missing():
    """What was called 0 lost before: all lines of an experiment gone, and the run's end."""
    kept = [line for line in FULL if not any(line.startswith(b"%c" % letter) for letter in b"BDEZ")]
    first = FULL[: 2 + 20 + 2 + 60]
    run = received(first + kept)
    assert run.done == {0}
    lost = ", ".join(f"experiment {number} (step) 80 lost on the line" for number in (2, 3))
    assert missing(tallies(PLAN, [run])) == f"80 of 240 samples came; missing: {lost}"


def test_a_stop_says_what_did_not_run():
    run = received(lines_of([20, 60, 20, 31], "stalled"))
    assert missing(tallies(PLAN, [run])) == (
        "131 of 240 samples came; missing: experiment 2 (step) 29 not run, experiment 3 (step) not run"
    )


def test_a_board_that_dies_is_not_heard_of():
    run = received(FULL[:40])
    assert "experiments 2 to 3 not reported by the board" in missing(tallies(PLAN, [run]))
    assert not run.log.accounted and not run.done


def test_a_second_run_makes_up_for_the_first():
    first, second = received(lines_of([20, 60, 20, 31], "stalled")), received(FULL)
    assert all(tally.whole for tally in tallies(PLAN, [first, second]))
    assert all(tally.whole for tally in tallies(PLAN, [second, first]))


def test_what_is_said_of_another_run_is_not_taken():
    run = received(lines_of([20, 60, 20, 31], "stalled", run=8))
    assert not run.log.reason and not run.log.accounted


def test_a_skip_is_no_loss_whichever_line_told_of_it():
    lines = lines_of([20, 35, 20, 60, 20, 60], "done")
    for lost in (b"E 63 ", b"B 64 ", None):
        run = received([line for line in lines if lost is None or not line.startswith(lost)])
        [first, *_] = tallies(PLAN, [run])
        assert first.whole and first.skipped == 25


@pytest.mark.parametrize("number", [1, 5])
def test_a_sentence_lists_three_and_counts_the_others(number):
    tally = tallies(PLAN, [received(FULL)])[0]
    lacking = [dataclasses.replace(tally, experiment=2 * k, lost=k + 1, whole=False) for k in range(number)]
    assert missing(lacking).count("experiment") == min(number, 3)
    assert ("and 2 more" in missing(lacking)) == (number == 5)
