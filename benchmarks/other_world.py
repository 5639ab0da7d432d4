"""Blind tests on the second plant: motors, plans, sizes and laws that the project's own generators do not have.

    python benchmarks/other_world.py [--parts one several nothing without outside] [--kinds coulomb_friction cogging]
        [--draws 1] [--seed 1] [--dirty] [--write DIR]

Found: each hidden effect is named, or an alternative that the recording does not tell from it, and nothing else is.
`several`: pairs and, every third, triples. `nothing`: right is no name. `without`: the hidden law may not be named, so
every name but its equals' is wrong. `outside`: laws of no effect; a relative (Coulomb friction of a LuGre bristle) is
no wrong name. Learned: the curve that explains most of the rest, the share of it, and what it is said to be like.
"""

import argparse
import dataclasses
import math
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from _calibration import Certain, Said, alike, bins, by_unexplained, is_found, log_loss, logistic, told
from second_world import LEVEL, Asked, Question, draw_questions
from testing.second_laws import OUTSIDE, VOCABULARY, several

from jaxmotor import JaxmotorError, diagnose
from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import Diagnosis
from jaxmotor.motor.effects import EFFECTS, LEARNED
from jaxmotor.recording import write

PARTS = ("one", "several", "nothing", "without", "outside")
NUMBER = {"several": 5, "nothing": 5}
"""Questions in a draw; else one of each kind."""
RELATIVES = {
    "bristle_friction": {"bristle_friction", "coulomb_friction", "stiction"},
    "friction_warming": {"warming_friction", "coulomb_friction", "stiction"},
    "friction_sector": {"sector_friction", "coulomb_friction", "stiction"},
    "cubic_drag": {"cubic_drag", "quadratic_drag"},
    "cubic_drive": {"cubic_drive"},
    "pwm_dead_time": {"dead_time"},
    "gravity_arm": {"cogging"},
}
"""Names that are right, or half right; of the arm wholly: its torque is a cogging of one cycle in a turn."""
EQUALS = {
    "voltage_offset": {"load_torque"},
    "load_torque": {"voltage_offset"},
    "coulomb_friction": {"stiction", "bristle_friction", "warming_friction"},
    "stiction": {"coulomb_friction"},
    "electrical_pole": {"sensor_lag", "transport_delay"},
    "sensor_lag": {"electrical_pole", "transport_delay"},
}
"""One equation, one that contains the other, or short lags of one response."""


TICK = 0.02
"""Of a row, by which a timing offset may be off beside three of its errors."""


@dataclasses.dataclass
class Tally:
    """What a part adds up to."""

    right: int = 0
    number: int = 0
    said: Said = dataclasses.field(default_factory=list)
    named: Said = dataclasses.field(default_factory=list)
    certain: list[Certain] = dataclasses.field(default_factory=list)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="*", default=PARTS, choices=PARTS)
    parser.add_argument("--kinds", nargs="*", help="of the parts one, without and outside", default=None)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dirty", action="store_true", help="speeds with noise at uneven times, a wandering torque")
    parser.add_argument("--write", type=Path, metavar="DIR", help="keep the recordings there")
    chosen = parser.parse_args()
    keep_programs(threads=True)
    asked = {part: _asked(part, chosen) for part in chosen.parts}
    begin = time.perf_counter()
    questions = _drawn([one for its in asked.values() for one in its])
    seconds = time.perf_counter() - begin
    print(f"{len(questions)} recordings simulated in {seconds:.0f} s; significance of each law at least {LEVEL:g}")
    if chosen.write is not None:
        _write(questions.values(), chosen.write)
    tallies = {part: _part(part, [questions[one] for one in its], chosen.dirty) for part, its in asked.items()}
    _summary(tallies)


def _drawn(asked: list[Asked]) -> dict[Asked, Question]:
    """Each once."""
    once = list(dict.fromkeys(asked))
    return dict(zip(once, draw_questions(once), strict=True))


def _write(questions: Iterable[Question], folder: Path) -> None:
    """As files that `jaxmotor diagnose` reads."""
    folder.mkdir(parents=True, exist_ok=True)
    for question in questions:
        write(question.recording, folder / Path(question.recording.source).name)


def _asked(part: str, chosen: argparse.Namespace) -> list[Asked]:
    found = []
    for seed in range(chosen.seed, chosen.seed + chosen.draws):
        # Apart from each other where the same is asked more than once.
        every = 1000 if part == "nothing" else 0
        found += [
            Asked(kinds, seed + every * k, chosen.dirty) for k, kinds in enumerate(_kinds(part, chosen.kinds, seed))
        ]
    return found


def _part(part: str, questions: list[Question], dirty: bool) -> Tally:
    print(f"\n## {part}{', dirty' if dirty else ''}\n")
    columns = ("hidden", "seed", "significance", "named", "probability (with its alternatives)", "verdict")
    more = ("drift chi2 held out", "likeliest not hidden", "learned: share of the rest", "right", "s")
    print(f"| {' | '.join(columns + more)} |\n|{'---|' * len(columns + more)}", flush=True)
    tally = Tally()
    for question in questions:
        _one(part, question, tally)
    print(f"\nright {tally.right} of {tally.number}", flush=True)
    return tally


def _kinds(part: str, named: list[str] | None, seed: int) -> list[tuple[str, ...]]:
    if part == "nothing":
        return [()] * NUMBER[part]
    if part == "several":
        rng = np.random.default_rng(seed)
        return [several(3 if k % 3 == 2 else 2, rng) for k in range(NUMBER[part])]
    return [(kind,) for kind in (OUTSIDE if part == "outside" else VOCABULARY) if named is None or kind in named]


def _one(part: str, question: Question, tally: Tally) -> None:
    begin = time.perf_counter()
    try:
        found = diagnose(question.recording, exclude=question.asked.kinds if part == "without" else ())
    except JaxmotorError as error:
        print(f"| {question.asked.name} | {question.asked.seed} | | {error} | | | | | | NO | |", flush=True)
        tally.number += 1
        return
    seconds = time.perf_counter() - begin
    question = _with_cogging(question, found)
    drawn, question = question.asked.name, _beside_timing(question, found)
    wrong = _wrong(part, question, found)
    right = is_found(question, found) if part in ("one", "several", "nothing") else not wrong
    tally.right, tally.number = tally.right + right, tally.number + 1
    spared = _spared(part, question)
    tally.said += [
        one for name, one in zip(found.probabilities, told(question, found), strict=True) if name not in spared
    ]
    for one in found.effects:
        if one.name not in spared:
            tally.named.append((one.family_probability, bool(set(alike(one)) & question.truth)))
    tally.certain += _certain(part, question, found)
    print(_row(drawn, question, found, right, seconds), flush=True)
    if not right:
        print(f"<!-- {question} -->", flush=True)


def _with_cogging(question: Question, found: Diagnosis) -> Question:
    """`question`, among whose kinds is the small cogging of a dirty log where that is found, with its cycles."""
    cycles = [one.parameters["cycles_per_rev"] for one in found.effects if one.name == "cogging" and one.is_named]
    if question.dirt is None or "cogging" in question.asked.kinds or question.plant.detent_cycles not in cycles:
        return question
    asked = dataclasses.replace(question.asked, kinds=(*question.asked.kinds, "cogging"))
    return dataclasses.replace(question, asked=asked)


def _beside_timing(question: Question, found: Diagnosis) -> Question:
    """`question` without a short delay or lag that is told as the log's own: where the header does not state when rows
    are read, less than half a row is the same as rows that are read as much before the voltage changes; and a mean over
    a window and a filter after it are the same as a mean over a longer one, as late as both. What is told with an error
    that holds zero, too, tells nothing."""
    dirt, plant, period_s = question.dirt, question.plant, question.rig.period_s
    lag_s = plant.inductance_H / plant.resistance_ohm
    by_kind = {"transport_delay": plant.delay_s, "sensor_lag": plant.filter_s, "electrical_pole": lag_s}

    def is_told(kind: str) -> bool:
        late = by_kind.get(kind, math.inf)
        told = []
        if found.timing is not None:
            told.append((-found.timing.offset_s, found.timing.standard_error_s))
        if found.average is not None and dirt is not None and not dirt.window_stated:
            mean_s = 0.5 * dirt.window_rows * period_s
            told.append((found.average.lateness_s - mean_s, found.average.lateness_error_s))
        return any(abs(one - late) < 3 * error + TICK * period_s and abs(one) > 3 * error for one, error in told)

    kinds = tuple(kind for kind in question.asked.kinds if not is_told(kind))
    return dataclasses.replace(question, asked=dataclasses.replace(question.asked, kinds=kinds))


def _spared(part: str, question: Question) -> set[str]:
    """Whose probability is neither right nor wrong."""
    kinds = question.asked.kinds
    if part == "without":
        return {"none", *kinds, *_of(EQUALS, kinds)}
    return {"none", *_of(RELATIVES, kinds)} if part == "outside" else set()


def _wrong(part: str, question: Question, found: Diagnosis) -> list[str]:
    """Effects that are told as causes and stand for nothing that was hidden; a learned law is no name."""
    right = _right(part, question)
    causes = [one for one in found.effects if one.name not in LEARNED and one.is_named]
    return [one.name for one in causes if not set(alike(one)) & right]


def _right(part: str, question: Question) -> set[str]:
    """Names that stand for something that was hidden. A law that is left out is named by none."""
    return set(question.truth) | _spared(part, question)


def _certain(part: str, question: Question, found: Diagnosis) -> list[Certain]:
    """Of each known effect that was found, named or not."""
    right = _right(part, question)
    hidden = {*question.truth, *question.asked.kinds, *_of(RELATIVES, question.asked.kinds)}
    families = {EFFECTS[name].family for name in hidden if name in EFFECTS}
    causes = [one for one in found.effects if one.name not in LEARNED]
    return [
        Certain(one.unexplained_share, bool(set(alike(one)) & right), one.effect.family in families) for one in causes
    ]


def _of(table: dict[str, set[str]], kinds: Iterable[str]) -> set[str]:
    return {name for kind in kinds for name in table.get(kind, ())}


def _row(drawn: str, question: Question, found: Diagnosis, right: bool, seconds: float) -> str:
    timing = f"rows {1e3 * found.timing.offset_s:.3g} ms off" if found.timing is not None else "none"
    named = "; ".join(" or ".join(alike(one)) for one in found.effects) or timing
    sure = ", ".join(f"{one.probability:.2f} ({one.family_probability:.2f})" for one in found.effects)
    other = next(
        (f"{name} {said:.2f}" for name, said in found.probabilities.items() if name not in question.truth | {"none"}),
        "",
    )
    learned = found.learned[0] if found.learned else None
    said = f"{learned.coordinate} {100 * learned.share:.0f} %, {learned.resemblance or '-'}" if learned else ""
    significance = " ".join(f"{one:.2g}" for one in question.significance)
    held = found.held_out
    return (
        f"| {drawn} | {question.asked.seed} | {significance} | {named} | {sure} | {found.verdict} "
        f"| {held.drift_before:.3g} -> {held.drift_after:.3g} | {other} | {said} | {'yes' if right else 'NO'} "
        f"| {seconds:.0f} |"
    )


def _summary(tallies: dict[str, Tally]) -> None:
    print("\n## summary\n\n| part | right | log loss |\n|---|---|---|")
    for part, tally in tallies.items():
        loss = f"{log_loss(tally.said):.3f}" if tally.said else ""
        print(f"| {part} | {tally.right} of {tally.number} | {loss} |")
    print(
        "\n| said | true, of effects tried and of none | true, of those named with their alternatives |\n|---|---|---|"
    )
    said = [one for tally in tallies.values() for one in tally.said]
    named = [one for tally in tallies.values() for one in tally.named]
    for (name, true, number), (_, good, all_named) in zip(bins(said), bins(named), strict=True):
        print(f"| {name} | {true} of {number} | {good} of {all_named} |")
    _certainty([one for tally in tallies.values() for one in tally.certain])
    if said:
        print(f"\nlog loss {log_loss(said):.3f} of {len(said)} probabilities")


def _certainty(certain: list[Certain]) -> None:
    """The table and the constants of `jaxmotor/diagnosis/_certainty.py`."""
    print("\n| unexplained share | right | its family is | effects |\n|---|---|---|---|")
    for name, right, family, number in by_unexplained(certain):
        print(f"| {name} | {right} | {family} | {number} |")
    if any(one.unexplained > 0 for one in certain):
        shares = [one.unexplained for one in certain]
        for what, true in (("names", [one.right for one in certain]), ("families", [one.family for one in certain])):
            half, power = logistic(shares, true)
            print(f"\n{what}: 1 / (1 + (share / {half:.3g})^{power:.2g})")


if __name__ == "__main__":
    main()
