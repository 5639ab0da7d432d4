"""Recordings of the second plant: motors drawn around data sheets, on plans of their own, with something wrong in them.

    python benchmarks/second_world.py KIND SEED OUT.csv [--dirty]

KIND is a law of `_second_laws.py`, several joined by +, or `none`. What a recording cannot show is no fair question: a
law whose significance is below `LEVEL` is drawn again, motor and plan with it. The significance is the sum of squares
of what the law changes in the readings, gain and pole refitted to first order, over the variance of a reading. Of
counts it is asked twice: of the angle, free by a constant in each segment, and (a quarter of `LEVEL` is enough) of
changes over some twenty rows, since a slow drift of the angle is evidence for nobody who distrusts his zero.
"""

import argparse
import dataclasses
import zlib
from collections.abc import Sequence

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter, ss2tf
from testing.second_laws import OUTSIDE, VOCABULARY, physical, with_laws
from testing.second_motors import Rig, draw_rig
from testing.second_plans import FAMILIES, Run, draw_plan
from testing.second_plant import STEP_S, Motion, Plant, Schedule, simulate

from jaxmotor.recording import Recording, Segment, from_arrays, write

LEVEL = 400.0
"""Significance: 20 standard deviations."""
MEMORY = 0.95
"""Of a residual that forgets: what remains of it a row later. Of slow changes hardly anything is seen in it."""
ATTEMPTS = 8
STILL_S = 0.1
"""A segment begins at rest where the count stood still for so long."""
TOGETHER = 100
"""Motors that are simulated side by side."""


@dataclasses.dataclass(frozen=True)
class Asked:
    """What is to be hidden."""

    kinds: tuple[str, ...]
    seed: int
    dirty: bool = False
    seconds: float | None = None
    """That the experiments last in all; None: one to three minutes."""

    @property
    def name(self) -> str:
        return "+".join(self.kinds) or "none"


@dataclasses.dataclass(frozen=True)
class Dirt:
    """What is not ideal about a log."""

    window_rows: int
    window_stated: bool
    noise: float
    """Of a speed, over the root mean square speed."""
    walk: float
    """Standard deviation of a random torque over the stall torque."""
    walk_s: float
    """Over which it is remembered."""
    detent: float
    """Cogging over the stall torque."""
    jitter: float
    """Of the row times, at most, over the period."""


@dataclasses.dataclass(frozen=True)
class Question:
    """A recording and what is behind it."""

    asked: Asked
    rig: Rig
    plant: Plant
    family: str
    dirt: Dirt | None
    recording: Recording
    significance: tuple[float, ...]
    """Of each kind alone, the others left in."""
    attempt: int

    @property
    def truth(self) -> frozenset[str]:
        """The hidden effects of the vocabulary."""
        return frozenset(self.asked.kinds) & VOCABULARY.keys()

    @property
    def outside(self) -> bool:
        return bool(set(self.asked.kinds) & OUTSIDE.keys())

    def __str__(self) -> str:
        rows = sum(len(one) for one in self.recording.segments)
        return (
            f"{self.rig.name}, {self.family}, {rows} rows of {1e3 * self.rig.period_s:g} ms, "
            f"{self.rig.counts_per_rev:.4g} counts, pole {self.plant.pole:.3g}, "
            f"L/R {self.plant.inductance_H / self.plant.resistance_ohm:.2g}; {physical(self.plant)}"
            f"{'' if self.dirt is None else f'; {self.dirt}'}"
        )


@dataclasses.dataclass(frozen=True)
class _Draft:
    """A question before it is simulated."""

    asked: Asked
    rig: Rig
    plant: Plant
    family: str
    runs: list[Run]
    dirt: Dirt | None
    schedule: Schedule
    begins: list[int]
    """Of each segment, its first row in the schedule."""
    without: tuple[Plant, ...]
    """The plant without each of the kinds."""


def draw_questions(asked: Sequence[Asked]) -> list[Question]:
    """One for each asked, as significant as `LEVEL` or the best of `ATTEMPTS`."""
    found: dict[int, Question] = {}
    for attempt in range(ATTEMPTS):
        open_ = [k for k in range(len(asked)) if k not in found or min(found[k].significance, default=LEVEL) < LEVEL]
        for some in _batches(open_):
            drafts = [_draft(asked[k], attempt) for k in some]
            for k, question in zip(some, _questions(drafts, attempt), strict=True):
                if k not in found or min(question.significance) > min(found[k].significance):
                    found[k] = question
    return [found[k] for k in range(len(asked))]


def _batches(numbers: list[int]) -> list[list[int]]:
    return [numbers[k : k + TOGETHER] for k in range(0, len(numbers), TOGETHER)]


def _draft(asked: Asked, attempt: int) -> _Draft:
    root = np.random.SeedSequence(
        [asked.seed, attempt, asked.dirty, *(zlib.crc32(kind.encode()) for kind in asked.kinds)]
    )
    of_rig, of_plan, of_laws, of_dirt = (np.random.default_rng(child) for child in root.spawn(4))
    rig = draw_rig(of_rig)
    family = FAMILIES[int(of_plan.integers(len(FAMILIES)))]
    runs = draw_plan(family, rig, of_plan, asked.seconds)
    dirt = _dirt(of_dirt) if asked.dirty else None
    pauses = np.maximum(of_plan.uniform(0.5, 1.0, len(runs)), 10 / rig.plant.pole)
    schedule, begins = _schedule(rig, runs, pauses, dirt, of_dirt)
    seconds = float(schedule.at[-1]) * STEP_S
    plant = with_laws(rig, asked.kinds, seconds, of_laws)
    if dirt is not None and "cogging" not in asked.kinds:
        plant = dataclasses.replace(plant, detent_N_m=dirt.detent * rig.stall_N_m, detent_cycles=7.0)
    return _Draft(asked, rig, plant, family, runs, dirt, schedule, begins, _without(rig, plant, asked, seconds, root))


def _without(rig: Rig, plant: Plant, asked: Asked, seconds: float, root: np.random.SeedSequence) -> tuple[Plant, ...]:
    """The plant without each of its kinds; of one kind without dirt, a linear motor, which needs no simulation."""
    if len(asked.kinds) < 2 and not asked.dirty:
        return ()
    found = []
    for kind in asked.kinds:
        own = with_laws(rig, (kind,), seconds, np.random.default_rng(root.spawn(1)[0]))
        names = [
            field.name
            for field in dataclasses.fields(Plant)
            if getattr(own, field.name) != getattr(rig.plant, field.name)
        ]
        found.append(dataclasses.replace(plant, **{name: getattr(rig.plant, name) for name in names}))
    return tuple(found)


def _dirt(rng: np.random.Generator) -> Dirt:
    return Dirt(
        window_rows=int(rng.integers(1, 11)),
        window_stated=bool(rng.integers(2)),
        noise=float(np.exp(rng.uniform(*np.log([0.002, 0.02])))),
        walk=float(rng.uniform(0.001, 0.006)),
        walk_s=float(rng.uniform(3, 20)),
        detent=float(rng.uniform(0.0005, 0.002)),
        jitter=float(rng.choice([0.0, 0.1, 0.2])),
    )


def _schedule(
    rig: Rig, runs: list[Run], pauses: np.ndarray, dirt: Dirt | None, rng: np.random.Generator
) -> tuple[Schedule, list[int]]:
    """Pause and rows in turn; shortly before each segment the shaft is read, to see whether it stands still."""
    every = round(rig.period_s / STEP_S)
    at: list[np.ndarray] = []
    volts: list[np.ndarray] = []
    begins, now, row = [], 0, 0
    for run, pause in zip(runs, pauses, strict=True):
        first = now + round(pause / STEP_S)
        rows = first + every * np.arange(len(run.duty))
        if dirt is not None:
            most = int(dirt.jitter * every)
            rows[1:] += rng.integers(-most, most + 1, len(rows) - 1)
        at += [np.array([now, first - round(STILL_S / STEP_S)]), rows]
        volts += [np.zeros(2), run.duty / rig.full_scale * rig.supply_V]
        begins.append(row + 2)
        row += 2 + len(rows)
        now = int(rows[-1]) + every
    steps = np.concatenate([*at, [now]])
    all_volts = np.concatenate([*volts, [0.0]])
    driven = np.ones(len(steps), bool)
    driven[[row - back for row in begins for back in (1, 2)] + [-1]] = False
    return Schedule(steps, all_volts, driven, _walk(rig, driven, dirt, rng)), begins


def _walk(rig: Rig, driven: np.ndarray, dirt: Dirt | None, rng: np.random.Generator) -> np.ndarray:
    """A torque that wanders, held between instants [N m]; its mean over the segments, which is a load, is taken out."""
    if dirt is None:
        return np.zeros(len(driven))
    keep = np.exp(-rig.period_s / dirt.walk_s)
    changes = rng.standard_normal(len(driven)) * np.sqrt(1 - keep**2)
    torque = dirt.walk * rig.stall_N_m * np.asarray(lfilter([1.0], [1.0, -keep], changes))
    return torque - torque[driven].mean()


def _questions(drafts: list[_Draft], attempt: int) -> list[Question]:
    plants = [plant for one in drafts for plant in (one.plant, *one.without)]
    schedules = [one.schedule for one in drafts for _ in range(1 + len(one.without))]
    motions = iter(simulate(plants, schedules))
    found = []
    for one in drafts:
        motion, others = next(motions), [next(motions) for _ in one.without]
        rng = np.random.default_rng([one.asked.seed, attempt, len(one.runs)])
        recording = _dirty(one, motion, rng) if one.dirt else _clean(one, motion, rng)
        significance = _significance(one, motion, [other.angle for other in others])
        found.append(Question(one.asked, one.rig, one.plant, one.family, one.dirt, recording, significance, attempt))
    return found


def _rows(draft: _Draft) -> list[slice]:
    return [slice(begin, begin + len(run.duty)) for begin, run in zip(draft.begins, draft.runs, strict=True)]


def _clean(draft: _Draft, motion: Motion, rng: np.random.Generator) -> Recording:
    """Encoder counts, which are only rounded."""
    rig, segments = draft.rig, []
    count = np.floor(motion.angle * rig.counts_per_rev / (2 * np.pi) + rng.uniform()).astype(np.int64)
    for run, rows in zip(draft.runs, _rows(draft), strict=True):
        tick = np.arange(len(run.duty))
        segments.append(
            Segment(
                run.kind,
                round(float(draft.schedule.at[rows.start]) * STEP_S, 6),
                bool(count[rows.start] == count[rows.start - 1]),
                {},
                tick * rig.period_s,
                run.duty / rig.full_scale * rig.supply_V,
                tick=tick,
                duty=run.duty.astype(np.int64),
                count=count[rows],
            )
        )
    return Recording(
        tuple(segments),
        f"{draft.asked.name}-{draft.asked.seed}.csv",
        period_s=rig.period_s,
        counts_per_rev=rig.counts_per_rev,
        duty_full_scale=float(rig.full_scale),
        supply_V=rig.supply_V,
        duty_delay_s=0.0,
    )


def _dirty(draft: _Draft, motion: Motion, rng: np.random.Generator) -> Recording:
    """Speeds over a window of rows with noise, at uneven times; the supply is stated."""
    assert draft.dirt is not None
    rig, dirt = draft.rig, draft.dirt
    speeds, _ = _speeds(draft, motion.angle)
    level = _noise(draft, motion)
    parts = [_rows(draft), speeds, draft.runs]
    kept = [dirt.window_rows if abs(motion.speed[rows.start]) > level else 0 for rows in parts[0]]
    return from_arrays(
        time_s=[draft.schedule.at[rows][k:] * STEP_S for rows, k in zip(parts[0], kept, strict=True)],
        duty=[run.duty[k:] for run, k in zip(draft.runs, kept, strict=True)],
        speed_rad_s=[(one + level * rng.standard_normal(len(one)))[k:] for one, k in zip(speeds, kept, strict=True)],
        duty_full_scale=rig.full_scale,
        counts_per_rev=rig.counts_per_rev,
        supply_V=rig.supply_V,
        speed_window_s=dirt.window_rows * rig.period_s if dirt.window_stated else None,
        kind=[run.kind for run in draft.runs],
        name=f"{draft.asked.name}-{draft.asked.seed}-dirty.csv",
    )


def _speeds(draft: _Draft, angle: np.ndarray) -> tuple[list[np.ndarray], float]:
    """Mean speed over the window before each row [rad/s]; before a segment the shaft is taken to stand still."""
    assert draft.dirt is not None
    back, found = draft.dirt.window_rows, []
    every = round(draft.rig.period_s / STEP_S)
    for rows in _rows(draft):
        turned, at = angle[rows], draft.schedule.at[rows]
        before = np.concatenate([np.full(back, turned[0]), turned])[: len(turned)]
        then = np.concatenate([at[0] - every * np.arange(back, 0, -1), at])[: len(at)]
        found.append((turned - before) / ((at - then) * STEP_S))
    return found, back * draft.rig.period_s


def _noise(draft: _Draft, motion: Motion) -> float:
    """Standard deviation of a logged speed [rad/s]."""
    assert draft.dirt is not None
    speed = np.concatenate([motion.speed[rows] for rows in _rows(draft)])
    return draft.dirt.noise * float(np.sqrt(np.mean(speed**2)))


def _significance(draft: _Draft, motion: Motion, others: list[np.ndarray]) -> tuple[float, ...]:
    """Of each kind."""
    linear = linear_angle(draft.rig.plant, draft.schedule)
    nuisance = _columns(draft, linear)
    changes = [motion.angle - other for other in others or ([linear] if draft.asked.kinds else [])]
    found = []
    for change in changes:
        whole = _beyond(*(_readings(draft, motion, one) for one in (change, *nuisance)))
        recent = np.inf if draft.dirt else 4 * _beyond(*(_recent(draft, one) for one in (change, *nuisance)))
        found.append(min(whole, recent))
    return tuple(found)


def _recent(draft: _Draft, change: np.ndarray) -> np.ndarray:
    """A change of the angle in differences of counts that add up over some twenty rows, in standard deviations."""
    per_count = 2 * np.pi / draft.rig.counts_per_rev / np.sqrt(6 * (1 + MEMORY))
    turned = [np.diff(change[rows]) for rows in _rows(draft)]
    return np.concatenate([np.asarray(lfilter([1.0], [1.0, -MEMORY], one)) for one in turned]) / per_count


def _columns(draft: _Draft, linear: np.ndarray) -> list[np.ndarray]:
    """What a little more gain, and a faster pole, change in the angle."""
    plant = draft.rig.plant
    faster = dataclasses.replace(plant, inertia_kg_m2=plant.inertia_kg_m2 * 0.999)
    return [1e-3 * linear, linear_angle(faster, draft.schedule) - linear]


def _readings(draft: _Draft, motion: Motion, change: np.ndarray) -> np.ndarray:
    """A change of the angle in readings, in standard deviations; a constant in each segment is nothing."""
    if draft.dirt is not None:
        return np.concatenate(_speeds(draft, change)[0]) / _noise(draft, motion)
    per_count = 2 * np.pi / draft.rig.counts_per_rev / np.sqrt(12)
    return np.concatenate([change[rows] - change[rows].mean() for rows in _rows(draft)]) / per_count


def _beyond(change: np.ndarray, *columns: np.ndarray) -> float:
    """Sum of squares of what `columns` leave of a change."""
    matrix = np.column_stack(columns)
    return float(np.sum((change - matrix @ np.linalg.lstsq(matrix, change)[0]) ** 2))


def linear_angle(plant: Plant, schedule: Schedule) -> np.ndarray:
    """Angle of the linear motor at each instant of `schedule`, by the exact hold [rad]."""
    resistance, constant, inertia = plant.resistance_ohm, plant.constant_V_s, plant.inertia_kg_m2
    system = np.zeros((4, 4))
    system[0] = [-resistance / plant.inductance_H, -constant / plant.inductance_H, 0, 1 / plant.inductance_H]
    system[1, :2] = constant / inertia, -plant.viscous_N_m_s / inertia
    system[2, 1] = 1.0
    held = expm(system * STEP_S)
    above, below = ss2tf(held[:3, :3], held[:3, 3:], np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 1)))
    fine = np.repeat(schedule.volts[:-1], np.diff(schedule.at))
    return np.asarray(lfilter(above[0], below, np.append(fine, 0.0)))[schedule.at]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind")
    parser.add_argument("seed", type=int)
    parser.add_argument("path")
    parser.add_argument("--dirty", action="store_true")
    chosen = parser.parse_args()
    kinds = () if chosen.kind == "none" else tuple(chosen.kind.split("+"))
    [question] = draw_questions([Asked(kinds, chosen.seed, chosen.dirty)])
    write(question.recording, chosen.path)
    print(question)


if __name__ == "__main__":
    main()
