"""A damaged log: what is accepted is what was sent."""

import random

import pytest
from faults import damage
from testing.wire import Script, hertz, level, unseal

FAULTS = 10_000
FIELDS = {"D": (4, 5), "B": (5,), "E": (6,), "Z": (4,), "A": (1,), "H": (5, 6, 7)}


@pytest.fixture
def log(bench) -> bytes:
    return bench(bytes(Script().command("H").add("sine", 4000, hertz(3.01, 0.005), level(170)).go())).raw


def accepted(data: bytes):
    for raw in data.split(b"\n"):
        try:
            line = unseal(raw)
        except (UnicodeDecodeError, ValueError):
            continue
        if line and len(line.fields) in FIELDS.get(line.type, ()):
            yield line


@pytest.mark.parametrize("per_log", [100, 1000, 3000])
def test_no_damaged_line_is_taken_for_another(log, per_log):
    rng = random.Random(per_log)
    sent = {line.sequence: line for line in accepted(log)}
    wrong = total = 0
    for _ in range(FAULTS // per_log):
        received = list(accepted(damage(log, per_log, rng)))
        total += len(received)
        wrong += sum(sent.get(line.sequence) != line for line in received)
    assert wrong == 0
    assert total > len(sent) * (FAULTS // per_log) * 0.1


def test_damaged_commands_never_change_the_plan(bench):
    """The board runs what was sent, or refuses; it never runs something else."""
    rng = random.Random(5)
    script = Script().add("step", 40, b=level(100)).add("sine", 40, hertz(5, 0.005), level(50))
    noise = [damage(bytes(script), 3, rng).replace(b"X", b"x").replace(b"H", b"h") for _ in range(20)]
    outcome = bench(b"\n".join(noise) + b"\n" + bytes(script.go()))
    assert [line.fields[2:] for line in outcome.of("B")] == [("step", "0", "40"), ("sine", "40", "40")]
    assert {duty for _, duty, _ in outcome.samples(0)} == {100}
