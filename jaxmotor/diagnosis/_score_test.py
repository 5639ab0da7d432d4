"""Which effects may be behind a residual, judged without fitting any.

Each effect is simulated once for each of its plausible sizes, on top of the linear motor. What that changes, less what
a change of the motor's own parameters would do as well, is a column; the part of the residual that a positive multiple
of the column explains is the effect's score. A score ranks and gives fits their start; it never names.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxmotor.diagnosis._evidence import begin_of
from jaxmotor.diagnosis._free import is_wide, motor_at, together, with_each, with_effect, without_effect
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._shared_program import shared_names
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import AbstractEffect, Rig, SpeedWindow, parameters
from jaxmotor.motor.effects._base import AbstractDelayEffect, AbstractWindingEffect


@dataclasses.dataclass(frozen=True, eq=False)
class EffectColumns:
    """One plausible size of an effect: what it changes. With a phase it has two columns, a quarter turn apart."""

    starts: tuple[AbstractEffect, ...]
    columns: np.ndarray
    """(n, 1 or 2) change of the residual [standard deviations]."""

    @property
    def name(self) -> str:
        return self.starts[0].name


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A start for a fit, and the chi2 per sample that its score promises."""

    effect: AbstractEffect
    chi2: float
    base: Fitted
    shift: np.ndarray
    """Of the parameters of `base`, that goes with the effect."""
    columns: np.ndarray
    """(n, 1 or 2) change of the residual by the effect of its plausible size."""
    size: np.ndarray
    """(1 or 2,) how many times these explain most."""

    @property
    def motor(self) -> Motor:
        """`base` with the effect, shifted no further than a step of a fit may go."""
        layout, free = self.base.layout, self.base.free
        shift = np.clip(self.shift, -layout.longest, layout.longest)
        moved = motor_at(self.base.template, np.clip(free + shift, layout.low, layout.high))
        return with_effect(moved, self.effect)

    @property
    def residual(self) -> np.ndarray:
        """(n,) what `base` leaves with so much of the effect, to first order."""
        return without_own(self.base, self.base.residual + np.einsum("nc,c->n", self.columns, self.size))


def effect_columns(
    solver: Solver, base: Fitted, rig: Rig, effects: Sequence[type[AbstractEffect]]
) -> tuple[EffectColumns, ...]:
    """Of those of `effects` that the recording could show, at the gain and pole of `base`.

    Where `base` has effects already, they are taken as if they did not change what a further one does, but for a delay:
    that comes as much later; and for the window of speeds. So no program is needed that the first effects have not
    needed.
    """
    motor, at = _bare(base.motor), None
    residual = base.residual if motor is base.motor else solver.residual_of(motor, base.speeds)[1]
    rows = round(late(base.motor) / rig.period_s)
    if rows:
        at = _rows_before(solver.piece, rows)
    starts = [effect.starts(rig) for effect in effects if not effect.sought_last]
    of = side_by_side(lambda own: _effect_columns(solver, base, own, motor, residual), starts)
    found = tuple(one for its in of for one in its)
    return found if at is None else tuple(dataclasses.replace(one, columns=one.columns[at]) for one in found)


def columns_beside(
    solver: Solver, base: Fitted, rig: Rig, effects: Sequence[type[AbstractEffect]], closely: bool = False
) -> tuple[EffectColumns, ...]:
    """Of those of `effects` that have a `program_level` and share the program of `base`: what they change beside all
    that `base` has. A motor that is held at rest, or that a load drives, shows little of what they do to one without.

    `closely` also of those that take a program more: lags, and laws of the winding beside another one.
    """
    names = None if is_wide(base.template.effects) else shared_names(base.motor, solver.sharing)
    if names is None:
        return ()
    wound = any(isinstance(effect, AbstractWindingEffect) for effect in base.template.effects)

    def shows(effect: type[AbstractEffect]) -> bool:
        if effect.program_level is not None:
            return closely or effect.name in names
        return closely and wound and issubclass(effect, AbstractWindingEffect)

    starts = [one.starts(rig) for one in effects if shows(one) and not one.sought_last and one.name not in base.names]
    of = side_by_side(lambda own: _effect_columns(solver, base, own, base.motor, base.residual), starts)
    return tuple(one for its in of for one in its)


def columns_at(
    solver: Solver,
    base: Fitted,
    rig: Rig,
    effects: Sequence[type[AbstractEffect]],
    parameter: str,
    values: Sequence[float],
) -> tuple[EffectColumns, ...]:
    """Of those of `effects` that the recording could show, beside all that `base` has, at these values of a parameter
    that is not fitted."""
    first = [effect.starts(rig)[:2] for effect in effects if effect.name not in base.names]
    starts = [tuple(one.but(**{parameter: value}) for value in values for one in own) for own in first if own]
    of = side_by_side(lambda own: _effect_columns(solver, base, own, base.motor, base.residual), starts)
    return tuple(one for its in of for one in its)


def best_beside(solver: Solver, base: Fitted, starts: tuple[AbstractEffect, ...]) -> list[Candidate]:
    """The `starts` of one effect beside `base` with all that it has, by their scores, the best first."""
    columns = _effect_columns(solver, base, starts, base.motor, base.residual)
    return candidates(base, tuple(columns)).get(starts[0].name, [])


def as_simulated(solver: Solver, base: Fitted, motors: Sequence[Motor]) -> list[Motor]:
    """`motors` of the same effects, those first that leave least, less what a change of the own parameters of `base`
    would take up as well."""
    speeds = np.repeat(base.speeds[None], len(motors), axis=0)
    left = without_own(base, solver.residuals(together(motors), speeds, base.steps).T)
    return [motors[place] for place in np.argsort([square_of(one) for one in left.T], kind="stable")]


def late(motor: Motor) -> float:
    """By how much the voltage acts late [s]."""
    return sum((float(one.delay()) for one in motor.effects if isinstance(one, AbstractDelayEffect)), 0.0)


def apparent_delay(motor: Motor) -> float:
    """The same of the readings: a mean over a window is half of that late."""
    windows = [float(one.length_s) for one in motor.effects if isinstance(one, SpeedWindow)]
    return late(motor) + sum(windows, 0.0) / 2


def _bare(motor: Motor) -> Motor:
    """`motor` without its effects, but with the window over which its speeds are means."""
    for effect in motor.effects:
        motor = motor if isinstance(effect, SpeedWindow) else without_effect(motor, effect.name)
    return motor


def _rows_before(piece: np.ndarray, rows: int) -> np.ndarray:
    """(n,) the row that is `rows` before each one in its piece `piece` (n,), or the first of that."""
    return np.clip(np.arange(len(piece)) - rows, begin_of(piece), len(piece) - 1)


def _effect_columns(
    solver: Solver, base: Fitted, starts: tuple[AbstractEffect, ...], motor: Motor, residual: np.ndarray
) -> list[EffectColumns]:
    """Of one effect, beside the `motor` of `base` or a simpler one, which leaves `residual`."""
    if not starts:
        return []
    begins = np.repeat(base.speeds[None], len(starts), axis=0)
    columns = solver.residuals(with_each(motor, starts), begins, base.steps) - residual
    columns = np.where(np.isfinite(columns).all(axis=1, keepdims=True), columns, 0.0)
    paired = any(about["kind"] == "amplitude" for about in parameters(starts[0]).values())
    size = 2 if paired else 1
    groups = [slice(begin, begin + size) for begin in range(0, len(starts), size)]
    return [EffectColumns(starts[group], columns[group].T) for group in groups]


def candidates(base: Fitted, found: tuple[EffectColumns, ...]) -> dict[str, list[Candidate]]:
    """Of each effect that `base` has not, the starts by their scores, the best first."""
    own = _own(base)
    left = base.residual - own.basis @ own.along(base.residual)
    square = square_of(left)
    count = len(left)
    scored: dict[str, list[Candidate]] = {}
    for columns_of in found:
        if columns_of.name in base.names:
            continue
        columns = columns_of.columns - np.einsum("np,pc->nc", own.basis, own.along(columns_of.columns))
        gain, most = _sized(columns_of, columns, left)
        size = most if len(most) == 2 or _is_signed(columns_of.starts[0]) else np.clip(most, 0.2, 5.0)
        shift = own.shift(base.residual + np.einsum("nc,c->n", columns_of.columns, size))
        effect = _of_size(columns_of, size)
        candidate = Candidate(effect, (square - gain) / count, base, shift, columns_of.columns, most)
        scored.setdefault(columns_of.name, []).append(candidate)
    return {name: sorted(starts, key=lambda start: start.chi2) for name, starts in scored.items()}


def _sized(columns_of: EffectColumns, columns: np.ndarray, left: np.ndarray) -> tuple[float, np.ndarray]:
    """By how much the columns lower the sum of squares, and about how many times the effect it takes (1 or 2,)."""
    normal, right = np.einsum("np,nq->pq", columns, columns), -np.einsum("np,n->p", columns, left)
    if not (np.diag(normal) > 1e-9).all():
        return 0.0, np.eye(1, len(right))[0]
    size = np.linalg.solve(normal + 1e-9 * np.diag(np.diag(normal)), right)
    gain = float(right @ size)
    if len(size) == 2:
        return gain, size
    if size[0] <= 0 and not _is_signed(columns_of.starts[0]):
        return 0.0, np.ones(1)
    return gain, size


def _is_signed(effect: AbstractEffect) -> bool:
    """A negative multiple of it is one, too. Of what a factor makes larger: a place on the shaft has a sign, too."""
    return any(about["kind"] == "signed" and about["neutral"] == 0.0 for about in parameters(effect).values())


def _of_size(columns_of: EffectColumns, size: np.ndarray) -> AbstractEffect:
    """The effect of these columns so many times."""
    if len(size) == 2:
        return _turned(columns_of.starts[0], size)
    return columns_of.starts[0] if size[0] == 1.0 else columns_of.starts[0].scaled(float(size[0]))


def _turned(start: AbstractEffect, size: np.ndarray) -> AbstractEffect:
    """`start`, of phase 0, with the amplitude and phase of a sum of it and its like a quarter turn on."""
    about, times = parameters(start).items(), float(np.hypot(*size))
    grown = {name: times * float(getattr(start, name)) for name, its in about if its["kind"] == "amplitude"}
    return start.but(**grown, phase_rad=float(np.arctan2(size[1], size[0])))


def without_own(base: Fitted, rows: np.ndarray) -> np.ndarray:
    """`rows` (n, ...) of residuals less what a change of the parameters of `base` would do as well."""
    own = _own(base)
    return rows - np.einsum("nk,k...->n...", own.basis, own.along(rows))


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
    weight = 1 / layout.spread
    long = np.vstack([base.jacobian, np.diag(weight)])
    scale = np.linalg.norm(long, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    left, sizes, right = np.linalg.svd(long / scale, full_matrices=False)
    used = sizes > 1e-7 * sizes[0]
    left = left[:, used]
    above = len(base.residual)
    inverse = (right[used].T / sizes[used]) / scale[:, None]
    return _Own(left[:above], inverse, left[above:].T @ (weight * (base.free - layout.prior)))
