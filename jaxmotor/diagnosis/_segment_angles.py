"""Where the shaft stood as each segment began, by what is locked to its angle, where a log does not hold it.

Within a segment the angle is the integral of the speeds, or that of a counter which began anew. There a law
A sin(n θ + φ) changes the residual by a c + b s, where c and s are what it changes at phases 0 and π/2; least squares
in each segment give a and b, and so the angle between segments, but for an n-th of a turn. The law, and n, are those of
which halves of segments predict most of each other; it must take up a tenth of what is left, as other effects must.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from jaxmotor.diagnosis._score_test import EffectColumns, effect_columns, without_own
from jaxmotor.diagnosis._search import LEAST
from jaxmotor.diagnosis._solve import Fitted, square_of
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._trial import begun, rig_of
from jaxmotor.motor.effects import BUILT_IN, LEARNED, AbstractEffect, parameters
from jaxmotor.prediction import shaft_angles

PREDICTED = 0.25
"""Part of what a law takes up in halves of segments that the other halves must predict: of noise it is less than 0, and
where the integral of the speeds drifts within a segment less than 1."""
CHANCE = 1e-6
"""Probability that one of so many waves takes up so much by chance; what the others do beside it tells how much that
is."""


def with_angles(study: Study, found: Fitted) -> Study | None:
    """`study` of its recording with the angle at which each segment begins; None where the log holds the angle, or
    where what `found` leaves does not tell."""
    recording, request, noise = study.recording, study.solver.request, study.packed.observation.noise
    if shaft_angles(recording) is not None or study.trial.angle is None:
        return None
    laws = _asked_waves(request.asked())
    waves = _waves(found, effect_columns(study.solver, found, rig_of(begun(recording), study.trial), laws))
    if not waves:
        return None
    segment, half = _halves(study)
    left = without_own(found, found.residual)
    best, sums = max(((one, _sums_of(one, left, segment, half)) for one in waves), key=lambda its: its[1].predicted)
    if not (sums.gain > LEAST * square_of(left) and sums.predicted > PREDICTED * sums.gain):
        return None
    others = [one for one in waves if one.name == best.name and one.cycles != best.cycles]
    if not others:
        return None
    typical = np.median([_sums_of(one, left - sums.taken, segment, half).gain for one in others])
    if len(waves) * _by_chance(sums.gain / typical, sums.number) > CHANCE:
        return None
    used = np.unique(segment)
    angles = np.zeros(len(recording.segments))
    angles[used] = np.mod(sums.phases[used] - sums.phases[used[0]], 2 * np.pi) / best.cycles
    return study_of(begun(recording, angles), study.pole_rad_s, study.timed, request, noise)


def _asked_waves(asked: Iterable[type[AbstractEffect]]) -> list[type[AbstractEffect]]:
    """The waves among the laws that are `asked` for, and those that a curve among these contains."""
    contained = [BUILT_IN[name] for effect in asked if effect.name in LEARNED for name in effect.contains]
    return [effect for effect in dict.fromkeys([*asked, *contained]) if _is_wave(effect)]


def _is_wave(effect: type[AbstractEffect]) -> bool:
    return {"phase_rad", "cycles_per_rev"} <= parameters(effect).keys()


def _halves(study: Study) -> tuple[np.ndarray, np.ndarray]:
    """(n,) segment of each row that counts, and in which half of that it is."""
    segment, row = (of.reshape(-1)[study.solver.cells] for of in (study.packed.segment_of, study.packed.row_of))
    middle = {index: np.median(row[segment == index]) for index in np.unique(segment).tolist()}
    return segment, (row > np.array([middle[index] for index in segment.tolist()])).astype(int)


class _Wave(NamedTuple):
    """What a law of so many cycles per turn changes."""

    name: str
    cycles: float
    columns: np.ndarray
    """(n, 2) at phases 0 and π/2, beside what the found motor's own parameters change."""


def _waves(found: Fitted, columns: tuple[EffectColumns, ...]) -> list[_Wave]:
    # A law of somebody else's may be told at one phase only.
    columns = tuple(one for one in columns if one.columns.shape[1] == 2)
    if not columns:
        return []
    rows = without_own(found, np.stack([one.columns for one in columns], axis=1))
    cycles = [float(one.starts[0].cycles_per_rev) for one in columns]  # pyright: ignore[reportAttributeAccessIssue]
    return [_Wave(one.name, number, rows[:, k]) for k, (one, number) in enumerate(zip(columns, cycles, strict=True))]


class _Sums(NamedTuple):
    """What a wave takes up of all segments."""

    gain: float
    """By how much it lowers the sum of squares, with a size and a phase in each segment."""
    predicted: float
    """The same with those of the other half of each segment."""
    taken: np.ndarray
    """(n,) of the residual."""
    phases: np.ndarray
    """(segments,) [rad]."""
    number: int
    """Of segments that show it."""


def _sums_of(wave: _Wave, left: np.ndarray, segment: np.ndarray, half: np.ndarray) -> _Sums:
    """Of `left` (n,), whose rows belong to `segment` (n,) and to its first `half` (n,), 0, or the second, 1."""
    columns, group, size = wave.columns, 2 * segment + half, 2 * int(segment.max()) + 2

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(group, values, size)

    normal = np.stack([[summed(p * q) for q in columns.T] for p in columns.T]).transpose(2, 0, 1)
    right = np.stack([-summed(p * left) for p in columns.T], axis=1)
    whole, both = normal.reshape(-1, 2, 2, 2).sum(1), right.reshape(-1, 2, 2).sum(1)
    sizes = _solved(whole, both)
    other = _solved(normal, right).reshape(-1, 2, 2)[:, ::-1].reshape(-1, 2)
    predicted = 2 * (right * other).sum() - np.einsum("gp,gpq,gq->", other, normal, other)
    return _Sums(
        float((both * sizes).sum()),
        float(predicted),
        -(columns * sizes[segment]).sum(axis=1),
        np.arctan2(sizes[:, 1], sizes[:, 0]),
        int((np.trace(whole, axis1=1, axis2=2) > 0).sum()),
    )


def _solved(normal: np.ndarray, right: np.ndarray) -> np.ndarray:
    least = 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300
    return np.linalg.solve(normal + least * np.eye(2), right[..., None])[..., 0]


def _by_chance(times: float, number: int) -> float:
    """How likely a gain is as large as so many `times` the typical one of other waves, if all were multiples of χ² of
    two degrees of freedom in each of a `number` of segments, whose cube root is nearly normal [Wilson and Hilferty
    1931]."""
    variance = 2 / (9 * 2 * max(number, 1))
    above = (math.cbrt(times) - 1) * (1 - variance) / math.sqrt(variance)
    return 0.5 * math.erfc(above / math.sqrt(2))
