"""Blind tests of `diagnose`: recordings in which an effect is hidden, and whether it is named.

    make -C firmware plant && python benchmarks/blind.py [--board] [--draws 5] [--first 0] [SUITE...]

SUITE: `none`, `single`, `pair`, `outside`, or names of effects. Recordings are those of `hidden.py`, or with --board of
`hidden_board.py`; the diagnosis sees nothing but them. Named: the first effect is the hidden one, or the hidden one is
among the rivals that the recording cannot tell from it. chi2 is held out; beside it the most by which it is above that
of the hidden motor itself on the same segments. Off: the median parameter. Inside: parameters whose 95 % interval holds
the truth.
"""

import argparse
import dataclasses
import sys
import time
from collections.abc import Sequence

import numpy as np
from hidden import OUTSIDE, SINGLE, Hidden, draw, pair_of
from hidden_board import draw_on_board

from jaxmotor._precision import in_float64
from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import Diagnosis, diagnose
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._score import scored
from jaxmotor.diagnosis._solve import Solver
from jaxmotor.diagnosis._split import split
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor import EFFECTS, Motor


@dataclasses.dataclass(frozen=True)
class Outcome:
    """One blind test."""

    suite: str
    seed: int
    truth: tuple[str, ...]
    right: bool
    verdict: str
    named: tuple[str, ...]
    chi2_before: float
    chi2_after: float
    """Held out."""
    chi2_truth: float
    """The same of the hidden motor itself; NaN where only the plant knows its phase."""
    drift_after: float
    errors_percent: tuple[float, ...]
    """Of the parameters of the effects that were named rightly."""
    z: tuple[float, ...]
    """Their errors, in standard errors."""
    linear_z: tuple[float, ...]
    """Gain and pole."""
    seconds: float

    def __str__(self) -> str:
        off = ", ".join(f"{error:.2g}" for error in self.errors_percent)
        return (
            f"{'right' if self.right else 'WRONG'} {self.suite} {self.seed}: {'+'.join(self.truth) or 'nothing'} -> "
            f"{self.verdict} {'+'.join(self.named) or 'no name'}; held out {self.chi2_before:.3g} -> "
            f"{self.chi2_after:.4g} (the hidden motor {self.chi2_truth:.4g}; drift {self.drift_after:.4g}); "
            f"off by {off or '-'} %, z {_list(self.z)}, gain and pole z {_list(self.linear_z)}; {self.seconds:.1f} s"
        )


def test(suite: str, seed: int, board: bool = False, effects: Sequence[str] | None = None) -> Outcome:
    """With `effects` no others may be named."""
    hidden = _drawn(suite, seed, board)
    begin = time.perf_counter()
    found = diagnose(hidden.recording, effects=effects)
    seconds = time.perf_counter() - begin
    errors, z = _parameters(hidden, found)
    return Outcome(
        suite,
        seed,
        tuple(hidden.truth),
        is_right(suite, hidden, found),
        found.verdict,
        tuple(effect.name for effect in found.effects),
        found.held_out.before.chi2_per_sample,
        found.held_out.after.chi2_per_sample,
        _truth_chi2(hidden),
        found.held_out.drift_after,
        errors,
        z,
        _linear(hidden, found, board),
        seconds,
    )


def _drawn(suite: str, seed: int, board: bool) -> Hidden:
    kinds = () if suite == "none" else pair_of(seed) if suite == "pair" else tuple(suite.split("+"))
    return draw_on_board(kinds, seed) if board else draw(kinds, seed)


def is_right(suite: str, hidden: Hidden, found: Diagnosis) -> bool:
    if suite in OUTSIDE:
        return found.verdict == "unexplained" and not found.effects and found.dependences[0].coordinate == "time"
    if not hidden.truth:
        return found.verdict == "complete"
    matched = [_matched(name, found) for name in hidden.truth]
    return all(matched) and len(found.effects) == len(hidden.truth)


def _matched(name: str, found: Diagnosis) -> bool:
    return any(
        name == effect.name or name in [one.name for one in effect.alternatives if one.inseparable]
        for effect in found.effects
    )


def _parameters(hidden: Hidden, found: Diagnosis) -> tuple[tuple[float, ...], tuple[float, ...]]:
    errors, z = [], []
    for effect in found.effects:
        for name, true in hidden.truth.get(effect.name, {}).items():
            if name == "phase_rad" or name not in effect.parameters:
                continue  # a phase is from where the counter stood at first, which only the plant knows
            value, error = effect.parameters[name], effect.standard_error[name]
            errors.append(100 * abs(value / true - 1))
            z.append((value - true) / max(error, 1e-9 * abs(true)))
    return tuple(errors), tuple(z)


@in_float64
def _truth_chi2(hidden: Hidden) -> float:
    """Held-out chi2 of the hidden motor itself: what a perfect diagnosis would reach on these segments."""
    if set(hidden.truth) - set(EFFECTS) or any("phase_rad" in sizes for sizes in hidden.truth.values()):
        return float("nan")
    study = study_of(hidden.recording, hidden.pole)
    held_out = Solver(study.trial, study.rows(split(hidden.recording)))
    return scored(held_out, _motor(hidden), hidden.recording, study.packed).score.chi2_per_sample


@in_float64
def truth_drift(hidden: Hidden) -> float:
    """chi2 of the hidden motor itself on the whole recording, of residuals that add up over twenty ticks."""
    study = study_of(hidden.recording, hidden.pole)
    return scored(study.solver, _motor(hidden), hidden.recording, study.packed).drift


def _motor(hidden: Hidden) -> Motor:
    effects = tuple(EFFECTS[name].of(**sizes) for name, sizes in sorted(hidden.truth.items()))
    lag = 0.0 if "electrical_pole" in hidden.truth else hidden.electrical_time_constant
    return linear_of(hidden.gain, hidden.pole, lag, hidden.viscous_share, effects)


def _linear(hidden: Hidden, found: Diagnosis, board: bool) -> tuple[float, ...]:
    if board and "supply_drift" in hidden.truth:
        return ()  # how far the supply had sunk before the recording began, only the board knows
    motor, error = found.motor.linear, found.standard_error
    return (
        (float(motor.gain) - hidden.gain) / error["gain_rad_s_V"],
        (float(motor.pole) - hidden.pole) / error["pole_rad_s"],
    )


def _list(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.2g}" for value in values) or "-"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("suites", nargs="*", default=["none", "single", "pair", "outside"])
    parser.add_argument("--draws", type=int, default=5, help="of each effect; 10 times as many nulls and pairs")
    parser.add_argument("--first", type=int, default=0, help="seed")
    parser.add_argument("--board", action="store_true", help="recorded by the firmware on the emulated board")
    chosen = parser.parse_args()
    keep_programs(threads=True)
    rows = []
    for suite in chosen.suites:
        kinds = {"single": SINGLE, "outside": OUTSIDE}.get(suite, (suite,))
        number = chosen.draws * (10 if suite in ("none", "pair") else 1)
        outcomes = []
        for kind in kinds:
            for seed in range(chosen.first, chosen.first + number):
                outcomes.append(test(kind, seed, chosen.board))
                print(outcomes[-1], file=sys.stderr, flush=True)
            rows.append(_row(kind, outcomes[-number:]))
        if len(kinds) > 1:
            rows.append(_row(f"all {suite}", outcomes))
    print(
        "| hidden | draws | right | chi2 <= 1.05 | above the hidden motor's | off, % | inside | gain, pole inside | s |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    print("\n".join(rows))


def _row(name: str, outcomes: list[Outcome]) -> str:
    errors = [error for one in outcomes for error in one.errors_percent]
    inside = [abs(z) < 1.96 for one in outcomes for z in one.z]
    linear = [abs(z) < 1.96 for one in outcomes for z in one.linear_z]
    off = f"{np.median(errors):.2g}" if errors else ""
    above = [one.chi2_after - one.chi2_truth for one in outcomes if np.isfinite(one.chi2_truth)]
    return (
        f"| {name} | {len(outcomes)} | {sum(one.right for one in outcomes)} "
        f"| {sum(one.chi2_after <= 1.05 for one in outcomes)} | {f'{max(above):.4f}' if above else ''} | {off} "
        f"| {sum(inside)}/{len(inside)} | {sum(linear)}/{len(linear)} "
        f"| {np.median([one.seconds for one in outcomes]):.1f} |"
    )


if __name__ == "__main__":
    main()
