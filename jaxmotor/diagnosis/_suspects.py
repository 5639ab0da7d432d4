"""Which effects may be behind a residual, judged without fitting any.

Each effect is simulated once for each of its plausible sizes, on top of the linear motor. What that changes, less what
a change of the motor's own parameters would do as well, is a column; the part of the residual that a positive multiple
of the column explains is the effect's score. A score ranks and gives fits their start; it never names.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxmotor.diagnosis._free import motor_at, with_each, with_effect
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import EFFECTS, AbstractEffect, Rig, parameters


@dataclasses.dataclass(frozen=True, eq=False)
class Secant:
    """One plausible size of an effect: what it changes. With a phase it has two columns, a quarter turn apart."""

    starts: tuple[AbstractEffect, ...]
    columns: np.ndarray
    """(n, 1 or 2) change of the residual [standard deviations]."""

    @property
    def name(self) -> str:
        return self.starts[0].name


@dataclasses.dataclass(frozen=True, eq=False)
class Suspect:
    """A start for a fit, and the chi2 per sample that its score promises."""

    effect: AbstractEffect
    chi2: float
    base: Fitted
    shift: np.ndarray
    """Of the parameters of `base`, that goes with the effect."""

    @property
    def motor(self) -> Motor:
        """`base` with the effect, shifted no further than a step of a fit may go."""
        layout, free = self.base.layout, self.base.free
        shift = np.clip(self.shift, -layout.longest, layout.longest)
        moved = motor_at(self.base.template, np.clip(free + shift, layout.low, layout.high))
        return with_effect(moved, self.effect)


def secants(solver: Solver, base: Fitted, rig: Rig) -> tuple[Secant, ...]:
    """Of every effect that the recording could show."""
    starts = [effect.starts(rig) for effect in EFFECTS.values()]
    return tuple(one for of in side_by_side(lambda own: _secants(solver, base, own), starts) for one in of)


def _secants(solver: Solver, base: Fitted, starts: tuple[AbstractEffect, ...]) -> list[Secant]:
    """Of one effect."""
    if not starts:
        return []
    speeds = np.repeat(base.speeds[None], len(starts), axis=0)
    width = solver.width(with_effect(base.motor, starts[0]))
    columns = solver.residuals(with_each(base.motor, starts), speeds, width) - base.residual
    columns = np.where(np.isfinite(columns).all(axis=1, keepdims=True), columns, 0.0)
    paired = any(about["kind"] == "amplitude" for about in parameters(starts[0]).values())
    size = 2 if paired else 1
    return [
        Secant(starts[begin : begin + size], columns[begin : begin + size].T) for begin in range(0, len(starts), size)
    ]


def suspects(base: Fitted, found: tuple[Secant, ...]) -> dict[str, list[Suspect]]:
    """Of each effect that `base` has not, the starts by their scores, the best first."""
    own = _own(base)
    left = base.residual - own.basis @ own.along(base.residual)
    square = square_of(left)
    count = len(left)
    scored: dict[str, list[Suspect]] = {}
    for secant in found:
        if secant.name in base.names:
            continue
        columns = secant.columns - np.einsum("np,pc->nc", own.basis, own.along(secant.columns))
        gain, size = _sized(secant, columns, left)
        there = base.residual + np.einsum("nc,c->n", secant.columns, size)
        suspect = Suspect(_of_size(secant, size), (square - gain) / count, base, own.shift(there))
        scored.setdefault(secant.name, []).append(suspect)
    return {name: sorted(starts, key=lambda start: start.chi2) for name, starts in scored.items()}


def _sized(secant: Secant, columns: np.ndarray, left: np.ndarray) -> tuple[float, np.ndarray]:
    """By how much the columns lower the sum of squares, and about how many times the effect it takes (1 or 2,)."""
    normal, right = np.einsum("np,nq->pq", columns, columns), -np.einsum("np,n->p", columns, left)
    if not (np.diag(normal) > 1e-9).all():
        return 0.0, np.eye(1, len(right))[0]
    size = np.linalg.solve(normal + 1e-9 * np.diag(np.diag(normal)), right)
    gain = float(right @ size)
    if len(size) == 2:
        return gain, size
    signed = any(about["kind"] == "signed" for about in parameters(secant.starts[0]).values())
    if size[0] <= 0 and not signed:
        return 0.0, np.ones(1)
    return gain, size if signed else np.clip(size, 0.2, 5.0)


def _of_size(secant: Secant, size: np.ndarray) -> AbstractEffect:
    """The secant's effect so many times."""
    if len(size) == 2:
        return _turned(secant.starts[0], size)
    return secant.starts[0] if size[0] == 1.0 else secant.starts[0].scaled(float(size[0]))


def _turned(start: AbstractEffect, size: np.ndarray) -> AbstractEffect:
    """`start`, of phase 0, with the amplitude and phase of a sum of it and its like a quarter turn on."""
    values = {name: float(getattr(start, name)) for name in parameters(start)}
    for name, about in parameters(start).items():
        if about["kind"] == "amplitude":
            values[name] *= float(np.hypot(*size))
    values["phase_rad"] = float(np.arctan2(size[1], size[0]))
    return type(start).of(**values)


class _Own(NamedTuple):
    """What a motor's own parameters can change; a prior holds some of it back. n rows, p parameters."""

    basis: np.ndarray
    """(n, k) orthonormal, but for what is the prior's."""
    inverse: np.ndarray
    """(p, k) from parts of the basis to parameters."""
    held: np.ndarray
    """(k,) what the prior adds to these parts."""

    def along(self, rows: np.ndarray) -> np.ndarray:
        """(k, ...) the basis' parts of `rows` (n, ...)."""
        return np.einsum("nk,n...->k...", self.basis, rows)

    def shift(self, residual: np.ndarray) -> np.ndarray:
        """(p,) of the parameters that lowers `residual` most."""
        return -self.inverse @ (self.along(residual) + self.held)


def _own(base: Fitted) -> _Own:
    layout = base.layout
    finite = np.isfinite(layout.spread)
    weight = np.where(finite, 1 / np.where(finite, layout.spread, 1.0), 0.0)
    long = np.vstack([base.jacobian, np.diag(weight)])
    scale = np.linalg.norm(long, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    left, sizes, right = np.linalg.svd(long / scale, full_matrices=False)
    used = sizes > 1e-7 * sizes[0]
    left = left[:, used]
    above = len(base.residual)
    inverse = (right[used].T / sizes[used]) / scale[:, None]
    return _Own(left[:above], inverse, left[above:].T @ (weight * (base.free - layout.prior)))
