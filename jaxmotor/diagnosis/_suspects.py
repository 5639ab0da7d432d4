"""Which effects may be behind a residual, judged without fitting any.

Each effect is simulated once for each of its plausible sizes, on top of the linear motor. What that changes, less what
a change of the motor's own parameters would do as well, is a column; the part of the residual that a positive multiple
of the column explains is the effect's score. A score ranks and gives fits their start; it never names.
"""

import dataclasses

import numpy as np

from jaxmotor.diagnosis._free import Layout, with_each, with_effect
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
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
    basis = _basis(base.jacobian, base.layout)
    left = base.residual - basis @ np.einsum("np,n->p", basis, base.residual)
    square = square_of(left)
    count = len(left)
    scored: dict[str, list[Suspect]] = {}
    for secant in found:
        if secant.name in base.names:
            continue
        columns = secant.columns - np.einsum("np,pc->nc", basis, np.einsum("np,nc->pc", basis, secant.columns))
        gain, effect = _scored(secant, columns, left)
        scored.setdefault(secant.name, []).append(Suspect(effect, (square - gain) / count))
    return {name: sorted(starts, key=lambda start: start.chi2) for name, starts in scored.items()}


def _scored(secant: Secant, columns: np.ndarray, left: np.ndarray) -> tuple[float, AbstractEffect]:
    """By how much the columns lower the sum of squares, and the effect of about the size that does."""
    normal, right = np.einsum("np,nq->pq", columns, columns), -np.einsum("np,n->p", columns, left)
    if not (np.diag(normal) > 1e-9).all():
        return 0.0, secant.starts[0]
    size = np.linalg.solve(normal + 1e-9 * np.diag(np.diag(normal)), right)
    gain = float(right @ size)
    if len(size) == 2:
        return gain, _turned(secant.starts[0], size)
    signed = any(about["kind"] == "signed" for about in parameters(secant.starts[0]).values())
    if size[0] <= 0 and not signed:
        return 0.0, secant.starts[0]
    factor = float(size[0]) if signed else float(np.clip(size[0], 0.2, 5.0))
    return gain, secant.starts[0].scaled(factor)


def _turned(start: AbstractEffect, size: np.ndarray) -> AbstractEffect:
    """`start`, of phase 0, with the amplitude and phase of a sum of it and its like a quarter turn on."""
    values = {name: float(getattr(start, name)) for name in parameters(start)}
    for name, about in parameters(start).items():
        if about["kind"] == "amplitude":
            values[name] *= float(np.hypot(*size))
    values["phase_rad"] = float(np.arctan2(size[1], size[0]))
    return type(start).of(**values)


def _basis(jacobian: np.ndarray, layout: Layout) -> np.ndarray:
    """Orthonormal columns of what the motor's own parameters can change; a prior holds some of it back."""
    finite = np.isfinite(layout.spread)
    weight = np.diag(np.where(finite, 1 / np.where(finite, layout.spread, 1.0), 0.0))
    long = np.vstack([jacobian, weight])
    scale = np.linalg.norm(long, axis=0)
    left, sizes, _ = np.linalg.svd(long / np.where(scale > 0, scale, 1.0), full_matrices=False)
    return left[: len(jacobian), sizes > 1e-7 * sizes[0]]
