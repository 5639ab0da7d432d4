"""What a sensible experimenter does in one to three minutes: steps, PRBS, waves, ramps; and the rests between."""

from typing import NamedTuple

import numpy as np

from testing.second_motors import Rig

POOLS = {
    "steps": ("step",),
    "prbs": ("prbs",),
    "waves": ("multisine", "chirp"),
    "ramps and steps": ("ramp", "step"),
    "everything": ("step", "ramp", "prbs", "chirp"),
}
FAMILIES = tuple(POOLS)
ROWS = 18_000
"""About as many as a recording may have: longer ones come at longer periods."""
REST_ROWS = 10


class Run(NamedTuple):
    """One segment."""

    kind: str
    duty: np.ndarray
    """(n,) int, of the rig's full scale; begins with a rest."""


def draw_plan(family: str, rig: Rig, rng: np.random.Generator, seconds: float | None = None) -> list[Run]:
    """Segments of `family`, of `seconds` in all, or as many as an experimenter has patience for."""
    drawn = min(float(rng.uniform(55, 150)), ROWS * rig.period_s)
    seconds = drawn if seconds is None else seconds
    number = int(rng.integers(6, 11))
    each = seconds / number
    runs = []
    for place, kind in enumerate(_kinds(family, number)):
        rows = round(each * rng.uniform(0.75, 1.25) / rig.period_s)
        level = _level(place, rng)
        shares = MAKERS[kind](rows, level, rig, rng)
        duty = np.rint(rig.full_scale * np.clip(shares, -1, 1)).astype(int)
        duty[:REST_ROWS] = 0
        runs.append(Run(kind, duty))
    return runs


def _kinds(family: str, number: int) -> list[str]:
    pool = POOLS[family]
    return [pool[k % len(pool)] for k in range(number)]


def _level(place: int, rng: np.random.Generator) -> float:
    """Large and small in turn, as a share of the supply."""
    return float(rng.uniform(0.65, 0.97) if place % 3 else rng.uniform(0.2, 0.45))


def _step(rows: int, level: float, rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """Levels of several heights both ways with rests between."""
    hold = max(int(rng.uniform(4, 9) / rig.plant.pole / rig.period_s), 15)
    shares: list[np.ndarray] = [np.zeros(REST_ROWS)]
    while sum(map(len, shares)) < rows:
        height = level * rng.choice([-1, 1]) * rng.uniform(0.3, 1.0)
        rest = np.zeros(round(hold * rng.uniform(0.3, 1.2)))
        shares += [np.full(round(hold * rng.uniform(0.7, 2.5)), height), rest]
    return np.concatenate(shares)[:rows]


def _prbs(rows: int, level: float, rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """Two levels about an offset, at random multiples of a clock."""
    clock = max(round(float(rng.uniform(0.4, 1.5)) / rig.plant.pole / rig.period_s), 2)
    offset = float(rng.uniform(-0.3, 0.3)) * (1 - level)
    signs = rng.choice([-1.0, 1.0], rows // clock + 1)
    return offset + np.repeat(level * signs, clock)[:rows]


def _multisine(rows: int, level: float, rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """Eight or so frequencies, evenly in the logarithm, of random phase."""
    time = np.arange(rows) * rig.period_s
    fastest = min(rig.plant.pole / 2, 0.6 / rig.period_s)
    speeds = np.exp(np.linspace(np.log(1.0), np.log(fastest), 8)) * rng.uniform(0.93, 1.07, 8)
    waves = np.sum([np.sin(w * time + rng.uniform(0, 2 * np.pi)) for w in speeds], axis=0)
    return level * waves / np.abs(waves).max()


def _chirp(rows: int, level: float, rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """A sine from slow to fast."""
    share = np.arange(rows) / rows
    slow, fast = 0.15 * rng.uniform(0.8, 1.2), min(rig.plant.pole / 3, 0.12 / rig.period_s)
    ratio = np.log(fast / slow)
    turns = slow * rows * rig.period_s * (np.exp(ratio * share) - 1) / ratio
    return level * np.sin(2 * np.pi * turns)


def _ramp(rows: int, level: float, rig: Rig, rng: np.random.Generator) -> np.ndarray:
    """Slow triangles from rest both ways."""
    del rig
    corners = level * np.array([0, 1, 0, -1, 0, 0.5, -0.5, 0]) * rng.choice([-1, 1])
    return np.interp(np.linspace(0, 7, rows), np.arange(8), corners)


MAKERS = {"step": _step, "prbs": _prbs, "multisine": _multisine, "chirp": _chirp, "ramp": _ramp}
