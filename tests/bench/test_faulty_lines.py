"""The real firmware behind a line that loses, doubles, delays and damages: a seeded part of three benchmarks."""

import os
import random

import pytest
from control_faults import PLAN, WHATS, count, points, run
from journal_damage import assess, bytes_changed, damage, interrupted
from stop_reasons import STOPS, sentence
from test_decoder import seal
from testing.line import Board, Fault, FaultyPort, noise, samples_of

from jaxmotor.bench import RecorderError, parse_plan, record, recover
from jaxmotor.bench._journal import journal_path, read_journal

SHORT = parse_plan(PLAN, "faults")


@pytest.fixture(scope="module")
def board(emulator):
    with Board() as board:
        yield board


@pytest.fixture(scope="module")
def control(board, tmp_path_factory):
    return points(board, SHORT, tmp_path_factory.mktemp("points"), "GABEZQH")


def test_any_one_control_line(board, control, tmp_path):
    """Lost, doubled, late or damaged, of those that carry no sample: nothing is missing then."""
    rng = random.Random(5)
    cases = [Fault(*point, what) for point in control for what in WHATS]
    chosen = rng.sample(cases, 40)
    totals, wrongs = count(board, (lambda f=f: FaultyPort(board.url, [f]) for f in chosen), SHORT, tmp_path)
    assert not wrongs and totals["complete"] == len(chosen)


def test_several_lines_at_random(board, control, tmp_path):
    rng = random.Random(6)
    every = points(board, SHORT, tmp_path, "ABCDEGHLPQRSZ")

    def drawn():
        return [Fault(*point, rng.choice(WHATS)) for point in rng.sample(every, rng.randrange(1, 7))]

    totals, wrongs = count(board, (lambda: FaultyPort(board.url, drawn()) for _ in range(40)), SHORT, tmp_path)
    assert not wrongs
    assert totals["resumed"] == totals["said to lack something"] > 5 and totals["complete"] > 3


def test_bytes_at_random(board, tmp_path):
    rng = random.Random(7)
    cases = (lambda: FaultyPort(board.url, hurt=noise(3e-3, rng)) for _ in range(20))
    totals, wrongs = count(board, cases, SHORT, tmp_path)
    assert not wrongs and totals["resumed"] > 5


def test_an_answer_to_go_that_is_late_starts_no_second_run(board, tmp_path):
    """What ran a plan twice: the answer late, or the beginning of the run lost."""
    late = [Fault(False, "A", 5, "late")]
    deaf = [Fault(False, letter, nth, "lost") for letter in "ABDE" for nth in range({"A": 9, "D": 25}.get(letter, 2))]

    def sound():
        return FaultyPort(board.url)

    for faults in (late, deaf[5:]):
        outcome = run(lambda faults=faults: FaultyPort(board.url, faults), SHORT, tmp_path, sound)
        assert not outcome.faults and outcome.starts == 1
        assert bool(outcome.said) == (faults is not late)


@pytest.mark.parametrize("word", sorted(STOPS))
def test_the_reason_of_a_stop_is_told_whichever_line_is_lost(emulator, tmp_path, word):
    stop = STOPS[word]
    said, port = sentence(stop, (), tmp_path)
    assert stop.said in said and len(said) <= 300
    control = [point for point in port.points if point[1] and point[1] not in "DS"]
    telling = [point for point in control if point[1] in "EZ" or point[:2] == (False, "H")]
    for point in [*random.Random(8).sample(control, 3), *telling[-3:]]:
        said, _ = sentence(stop, (Fault(*point, "lost"),), tmp_path)
        assert stop.said in said and len(said) <= 300, (point, said)


def test_a_damaged_journal_is_recovered_or_refused_never_wrong(emulator, tmp_path):
    plan, output = interrupted(tmp_path)
    data, whole = journal_path(output).read_bytes(), recover(output)
    there, rng = samples_of(whole, plan), random.Random(9)
    assert len(there) > 100
    changed = [assess(plan, output, each, whole, there) for each in bytes_changed(data, 41, rng)]
    assert set(changed) <= {"whole", "partly recovered", "refused"}
    assert changed.count("refused") == 0, "everything that one byte could take away is there twice"
    several = [assess(plan, output, damage(data, rng.randrange(2, 41), rng), whole, there) for _ in range(40)]
    assert set(several) <= {"whole", "partly recovered", "refused"} and "partly recovered" in several


def test_what_is_damaged_in_a_journal_is_said(emulator, tmp_path):
    _, output = interrupted(tmp_path)
    path = journal_path(output)
    data = path.read_bytes()
    at = data.index(b"\nD ") + 8
    path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
    kept = read_journal(path)
    assert kept.damaged == 1 and kept.done == set()


@pytest.mark.parametrize(
    ("note", "said"),
    [
        ('# plan {"journal": 1, "plan": {}}', "its plan is not understood"),
        ('# plan {"journal": 2, "plan": {"experiments": 3}}', "its plan is not understood"),
        ('# plan {"journal": 2, "plan": {"experiments": [], "name": 3, "period_ms": 5}}', "its plan is not understood"),
        ("# plan " + '{"a":' * 100_000, "not a journal"),
        ("# jaxmotor journal 1", "not a journal"),
        ("", "not a journal"),
    ],
)
def test_a_journal_from_a_stranger_is_refused_in_a_sentence(tmp_path, note, said):
    (tmp_path / "r.csv.part").write_bytes(seal(note) if note else b"")
    with pytest.raises(RecorderError, match=said):
        recover(tmp_path / "r.csv")


def test_no_file_in_the_journals_place(tmp_path):
    os.mkfifo(tmp_path / "r.csv.part")
    with pytest.raises(RecorderError, match="nothing to continue"):
        recover(tmp_path / "r.csv")
    with pytest.raises(RecorderError, match="is no file"), Board() as board:
        record(SHORT, lambda: FaultyPort(board.url), tmp_path / "r.csv", check=False, force=True)
