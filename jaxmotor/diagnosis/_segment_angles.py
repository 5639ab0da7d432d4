"""Where the shaft stood as each segment of a log of speeds began, by what is locked to its angle.

Within a segment the angle is the integral of the speeds. There a law A sin(n θ + φ) changes the residual by a c + b s,
where c and s are what it changes at phases 0 and π/2; least squares in each segment give a and b, and so the angle
between segments, but for an n-th of a turn. The law, and n, are those of which halves of segments predict most of each
other; it must take up a tenth of what is left, as other effects must.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from jaxmotor.diagnosis._score_test import EffectColumns, effect_columns, without_own
from jaxmotor.diagnosis._search import LEAST
from jaxmotor.diagnosis._solve import Fitted, square_of
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.motor.effects import AbstractEffect, parameters
from jaxmotor.prediction import shaft_angles
from jaxmotor.recording import Recording

PREDICTED = 0.5
"""Part of what a law takes up in halves of segments that the other halves must predict: of noise it is less than 0."""
CHANCE = 1e-6
"""Probability that one of so many waves takes up so much by chance; the others tell how much that is."""


def with_angles(study: Study, found: Fitted) -> Recording | None:
    """The recording of `study` with the angle at which each segment begins; None where it is no log of speeds in
    several segments, or where what `found` leaves does not tell."""
    recording = study.recording
    begun = _begun(recording, np.zeros(len(recording.segments)))
    if recording.measured != "speed" or shaft_angles(recording) is not None or shaft_angles(begun) is None:
        return None
    waves = [effect for effect in study.solver.request.asked() if _is_wave(effect)]
    noise = study.packed.observation.noise
    there = study_of(begun, study.pole_rad_s, study.timed, study.solver.request, noise)
    columns = effect_columns(there.solver, found, rig_of(begun, there.trial), waves)
    if not columns:
        return None
    segment, half = _halves(there)
    left = without_own(found, found.residual)
    sums = [_sums_of(one, found, left, 2 * segment + half) for one in columns]
    best = max(sums, key=lambda one: one.predicted)
    matters = best.gain > LEAST * square_of(left)
    if not (matters and best.predicted > PREDICTED * best.gain and _by_chance(best, sums) < CHANCE):
        return None
    used = np.unique(segment)
    angles = np.zeros(len(recording.segments))
    angles[used] = np.mod(best.phases[used] - best.phases[used[0]], 2 * np.pi) / best.cycles
    return _begun(recording, angles)


def _begun(recording: Recording, angles: np.ndarray) -> Recording:
    """`recording`, whose segments begin at `angles` [rad]."""
    runs = zip(recording.segments, angles.tolist(), strict=True)
    segments = tuple(dataclasses.replace(segment, begins_rad=angle) for segment, angle in runs)
    return dataclasses.replace(recording, segments=segments)


def _is_wave(effect: type[AbstractEffect]) -> bool:
    return {"phase_rad", "cycles_per_rev"} <= parameters(effect).keys()


def _halves(study: Study) -> tuple[np.ndarray, np.ndarray]:
    """(n,) segment of each row that counts, and in which half of that it is."""
    segment, row = (of.reshape(-1)[study.solver.cells] for of in (study.packed.segment_of, study.packed.row_of))
    middle = {index: np.median(row[segment == index]) for index in np.unique(segment).tolist()}
    return segment, (row > np.array([middle[index] for index in segment.tolist()])).astype(int)


class _Sums(NamedTuple):
    """What one wave does in all segments."""

    name: str
    cycles: float
    gain: float
    """By how much it lowers the sum of squares, with a size and a phase in each segment."""
    predicted: float
    """The same with those of the other half of each segment."""
    phases: np.ndarray
    """(segments,) [rad]."""
    number: int
    """Of segments that show it."""


def _sums_of(one: EffectColumns, found: Fitted, left: np.ndarray, group: np.ndarray) -> _Sums:
    """Of what `found` leaves, `left` (n,), whose rows belong to `group` (n,): twice the segment, and one in its second
    half."""
    columns = without_own(found, one.columns)
    size = int(group.max()) // 2 * 2 + 2

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(group, values, size)

    normal = np.stack([[summed(p * q) for q in columns.T] for p in columns.T]).transpose(2, 0, 1)
    right = np.stack([-summed(p * left) for p in columns.T], axis=1)
    whole, both = normal.reshape(-1, 2, 2, 2).sum(1), right.reshape(-1, 2, 2).sum(1)
    sizes = _solved(whole, both)
    other = _solved(normal, right).reshape(-1, 2, 2)[:, ::-1].reshape(-1, 2)
    predicted = 2 * (right * other).sum() - np.einsum("gp,gpq,gq->", other, normal, other)
    return _Sums(
        one.name,
        float(one.starts[0].cycles_per_rev),  # pyright: ignore[reportAttributeAccessIssue]
        float((both * sizes).sum()),
        float(predicted),
        np.arctan2(sizes[:, 1], sizes[:, 0]),
        int((np.trace(whole, axis1=1, axis2=2) > 0).sum()),
    )


def _solved(normal: np.ndarray, right: np.ndarray) -> np.ndarray:
    least = 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300
    return np.linalg.solve(normal + least * np.eye(2), right[..., None])[..., 0]


def _by_chance(best: _Sums, sums: list[_Sums]) -> float:
    """How likely the largest gain of so many waves is as large as that of `best`, if all gains were multiples of χ² of
    2 `best.number` degrees of freedom, whose cube root is nearly normal [Wilson and Hilferty 1931]."""
    others = [one.gain for one in sums if one.name == best.name and one.cycles != best.cycles]
    typical = float(np.median(others)) if others else np.inf
    variance = 2 / (9 * 2 * max(best.number, 1))
    above = (np.cbrt(best.gain / max(typical, 1e-300)) - 1) * (1 - variance) / math.sqrt(variance)
    return len(sums) * 0.5 * math.erfc(above / math.sqrt(2))
