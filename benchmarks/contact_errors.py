"""How wrong the sizes of a backlash are, beside what the noise of the encoder alone would give.

    make -C firmware plant && python benchmarks/contact_errors.py [--draws 14] [--others 7] [--pairs 4]

Recordings are those of `blind.py backlash`, and `--others` of the second world, whose gears meet harder than the law
says (100 to 200 Hz for 90, a damping ratio of 0.2 to 0.5 for 0.3); of seeds that no test uses. With s the relative
standard error that the linearised fit gives a size, its error is taken to be normal with the variance
(unlikeness s)² + roughness²; both numbers are those of the largest likelihood. The package has those of the second
world: of no gears it is known how they meet. Printed beside them: how many sizes are inside their 95 % interval with
these numbers and with those of the package, and how many poles; and from `--pairs` of the blind tests how many times
the noise alone the errors of the effect beside a backlash are.
"""

import argparse
import itertools
import sys
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from hidden import draw, pair_of
from scipy.optimize import minimize
from second_world import Asked, draw_questions

from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import Diagnosis, diagnose
from jaxmotor.motor.effects import Backlash
from jaxmotor.recording import Recording

NAME = Backlash.name
STATED, BESIDE = (Backlash.roughness, Backlash.unlikeness), Backlash.unlikeness_beside
INSIDE = 1.96
"""Standard errors of a 95 % interval."""


class Hidden(NamedTuple):
    """A backlash in a recording."""

    label: str
    recording: Recording
    sizes: dict[str, dict[str, float]]
    """Of the effects that are looked at, by their names."""
    pole_rad_s: tuple[float, ...]
    """None where the recording's maker does not state it."""


def of_blind_tests(seeds: range) -> Iterator[Hidden]:
    for seed in seeds:
        hidden = draw((NAME,), seed)
        yield Hidden(f"blind {seed}", hidden.recording, {NAME: hidden.truth[NAME]}, (hidden.pole,))


def of_second_world(seeds: range) -> Iterator[Hidden]:
    for seed in seeds:
        [question] = draw_questions([Asked((NAME,), seed, False)])
        plant = question.plant
        sizes = {"gap_rad": plant.gap_rad, "inertia_ratio": plant.load_kg_m2 / plant.inertia_kg_m2}
        yield Hidden(f"second world {seed}", question.recording, {NAME: sizes}, ())


def of_pairs(seeds: range) -> Iterator[Hidden]:
    """Of the effect beside the backlash: as many as there are seeds, from the first on whose pair has one."""
    having = (seed for seed in itertools.count(seeds.start) if NAME in pair_of(seed))
    for seed in itertools.islice(having, len(seeds)):
        hidden = draw(pair_of(seed), seed)
        beside = {name: sizes for name, sizes in hidden.truth.items() if name != NAME}
        yield Hidden(f"pair {seed}", hidden.recording, beside, ())


class Errors(NamedTuple):
    """Relative ones, and the standard errors that the fit alone gives them."""

    error: np.ndarray
    own: np.ndarray

    def z(self, roughness: float, unlikeness: float) -> np.ndarray:
        return self.error / np.sqrt(self.variance(roughness, unlikeness))

    def variance(self, roughness: float, unlikeness: float) -> np.ndarray:
        return (unlikeness * self.own) ** 2 + roughness**2


def size_errors(hidden: Hidden, found: Diagnosis) -> list[tuple[float, float]]:
    """None of effects that are not named, nor of phases, which only the plant knows."""
    named = [effect for effect in found.effects if effect.name in hidden.sizes]
    return [
        (effect.parameters[size] / true - 1, effect.standard_error[size] / abs(true))
        for effect in named
        for size, true in hidden.sizes[effect.name].items()
        if size in effect.parameters and size != "phase_rad"
    ]


def pole_error(hidden: Hidden, found: Diagnosis) -> list[tuple[float, float]]:
    """None where the pole is not known."""
    error = found.standard_error["pole_rad_s"]
    return [(float(found.motor.linear.pole) / true - 1, error / true) for true in hidden.pole_rad_s]


def most_likely(sizes: Errors) -> tuple[float, float]:
    """Roughness and unlikeness."""

    def loss(logs: np.ndarray) -> float:
        variance = sizes.variance(*np.exp(logs))
        return float((np.log(variance) + sizes.error**2 / variance).sum())

    starts = [np.log([rough, unlike]) for rough in (0.01, 0.05) for unlike in (1.0, 5.0, 20.0)]
    best = min((minimize(loss, start, method="Nelder-Mead") for start in starts), key=lambda found: found.fun)
    roughness, unlikeness = np.exp(best.x)
    return float(roughness), float(unlikeness)


def _inside(z: np.ndarray) -> str:
    return f"{(np.abs(z) < INSIDE).sum()} of {len(z)} inside, rms {np.sqrt(np.mean(z**2)):.2f} standard errors"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=14, help="of the blind tests")
    parser.add_argument("--others", type=int, default=7, help="of the second world")
    parser.add_argument("--pairs", type=int, default=4, help="of the blind tests that have a backlash")
    parser.add_argument("--first", type=int, default=700, help="seed")
    chosen = parser.parse_args()
    keep_programs(threads=True)
    seeds = (range(chosen.first, chosen.first + number) for number in (chosen.draws, chosen.others, chosen.pairs))
    (sizes, poles), (others, _), (beside, _) = map(_found, (of_blind_tests, of_second_world, of_pairs), seeds)
    for name, errors in (("blind tests", sizes), ("second world", others)):
        if not len(errors.error):
            continue
        off, numbers = 100 * np.abs(errors.error), most_likely(errors)
        print(f"{name}: sizes off by {np.median(off):.2g} % (median), {off.max():.2g} % (most)")
        print(
            f"  most likely, roughness {numbers[0]:.3f} and unlikeness {numbers[1]:.2f}: {_inside(errors.z(*numbers))}"
        )
        print(f"  the package's, {STATED[0]:g} and {STATED[1]:g}: {_inside(errors.z(*STATED))}")
    if len(beside.error):
        print(
            f"beside it: {_inside(beside.z(0.0, 1.0))}; with the package's {BESIDE:g}: {_inside(beside.z(0.0, BESIDE))}"
        )
    # The pole is the rotor's, and with it half as wrong as the load's share of the inertia.
    if len(poles.error):
        print(f"poles, with half the package's roughness: {_inside(poles.z(0.5 * STATED[0], 1.0))}")


def _found(made: Callable[[range], Iterator[Hidden]], seeds: range) -> tuple[Errors, Errors]:
    """Errors of sizes and of poles, with the standard errors of the fit alone."""
    Backlash.roughness, Backlash.unlikeness, Backlash.unlikeness_beside = 0.0, 1.0, 1.0
    sizes, poles = [], []
    for hidden in made(seeds):
        found = diagnose(hidden.recording)
        own, pole = size_errors(hidden, found), pole_error(hidden, found)
        sizes += own
        poles += pole
        off = ", ".join(f"{100 * error:.2g} ± {100 * standard:.2g} %" for error, standard in own + pole)
        print(f"{hidden.label}: {found.verdict}, off by {off or 'unknown'}", file=sys.stderr, flush=True)
    return Errors(*np.reshape(sizes, (-1, 2)).T), Errors(*np.reshape(poles, (-1, 2)).T)


if __name__ == "__main__":
    main()
