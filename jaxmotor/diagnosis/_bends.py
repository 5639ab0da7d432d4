"""Where the slope of a learned curve changes at once: every place is tried, to first order in all else."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxmotor.diagnosis._free import with_each, with_effect, without_effect
from jaxmotor.diagnosis._places import moved
from jaxmotor.diagnosis._score_test import without_own
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor.effects import NO_PLACE, AbstractBentEffect

PLACES = 24
"""That are tried at once: over the curve's reach, then around the best of them, and twice more beside its fit."""
LAST = 1 - 0.5 / PLACES
"""Of these places: how steep a curve is beyond it, few rows tell."""
BETTER, FINER = 0.01, 1e-4
"""Parts of the sum of squares that bends must take up to be kept, and that they must at another place to be moved."""


def with_bends(solver: Solver, base: Fitted, fitted: Fitted, tolerance: float, bar: float = np.inf) -> Fitted:
    """`fitted`, whose learned curves have their bends at the best place, where that leaves less; those that have a
    place keep it, and those of `base` do where `fitted` only adds to it. Bends that promise no chi2 below `bar` are not
    fitted."""
    known = base.names if set(base.names) <= set(fitted.names) else ()
    for effect in fitted.motor.effects:
        if effect.name not in known and isinstance(effect, AbstractBentEffect) and float(effect.bend_share) == NO_PLACE:
            shares = (np.arange(PLACES) + 0.5) / PLACES
            bent = _placed(solver, fitted, effect, [shares, _around(1 / PLACES)], tolerance, bar)
            fitted = fitted if bent is fitted else _finer(solver, bent, effect.name, tolerance)
    return fitted


def _finer(solver: Solver, fitted: Fitted, name: str, tolerance: float) -> Fitted:
    """`fitted` with the bends of its curve `name` at better places near theirs, as they are simulated with its size."""
    for reach in (1 / PLACES, 2 / PLACES**2):
        effect = next(own for own in fitted.motor.effects if own.name == name)
        assert isinstance(effect, AbstractBentEffect)
        shares = float(effect.bend_share) + _around(reach)
        others = tuple(effect.but(bend_share=share) for share in shares[(shares > 0) & (shares <= LAST)].tolist())
        fitted = moved(solver, fitted, others, tolerance, FINER)
    return fitted


def _around(reach: float) -> np.ndarray:
    return reach * np.linspace(-1, 1, PLACES + 1)


def _placed(
    solver: Solver, fitted: Fitted, effect: AbstractBentEffect, tried: list[np.ndarray], tolerance: float, bar: float
) -> Fitted:
    """`fitted` with the bends of its curve `effect` at the best of the places `tried`, each relative to the best before
    it, where it leaves less so."""
    if not np.isfinite(fitted.jacobian).all():
        return fitted
    bare, share, least = _without_bends(fitted, effect), 0.0, np.inf
    for places in tried:
        places = share + places
        share, least = _best(solver, bare, effect, places[(places > 0) & (places <= LAST)])
    if not least < min((1 - BETTER) * square_of(fitted.residual), bar * len(fitted.residual)):
        return fitted
    start = effect.but(bend_share=share, **dict.fromkeys(effect.bend_terms, 0.0))
    new = solver.fit(with_effect(without_effect(fitted.motor, effect.name), start), fitted, tolerance)
    return min(fitted, new, key=lambda one: one.chi2)


def _without_bends(fitted: Fitted, effect: AbstractBentEffect) -> Fitted:
    """`fitted` with a straight part in their place, which no parameter changes; to first order."""
    own = [fitted.layout.names.index(f"{effect.name}.{bend}") for bend in effect.bend_terms]
    residual = fitted.residual - fitted.jacobian[:, own] @ fitted.free[own]
    jacobian, free = fitted.jacobian.copy(), fitted.free.copy()
    jacobian[:, own], free[own] = 0.0, 0.0
    return dataclasses.replace(fitted, residual=residual, jacobian=jacobian, free=free)


def _best(solver: Solver, bare: Fitted, effect: AbstractBentEffect, shares: np.ndarray) -> tuple[float, float]:
    """The best of the places `shares` (k,), and the sum of squares that bends there leave."""
    columns = _columns(solver, bare, effect, shares)
    left, residual = without_own(bare, columns), without_own(bare, bare.residual)
    squares = [_left(left[:, k :: len(shares)], residual) for k in range(len(shares))]
    best = int(np.argmin(squares))
    return float(shares[best]), squares[best]


def _columns(
    solver: Solver, bare: Fitted, effect: AbstractBentEffect, shares: np.ndarray
) -> Float[np.ndarray, "n two_k"]:
    """What each bend of a small size adds to the residual at each of `shares`: (n, k) of the first, then the other."""
    plain = effect.but(**dict.fromkeys(effect.bend_terms, 0.0))
    size = 0.1 * max(abs(float(getattr(effect, bend))) for bend in effect.bend_terms) or 0.01
    bent = [plain.but(**{bend: size, "bend_share": float(share)}) for bend in effect.bend_terms for share in shares]
    motors = with_each(without_effect(bare.motor, effect.name), [plain, *bent])
    found = solver.residuals(motors, np.repeat(bare.speeds[None], len(bent) + 1, axis=0), bare.steps)
    return (found[1:] - found[0]).T / size


def _left(columns: Float[np.ndarray, "n two"], residual: np.ndarray) -> float:
    """Sum of squares of `residual` less what `columns` do; infinite where these are."""
    if not np.isfinite(columns).all():
        return np.inf
    sizes, *_ = np.linalg.lstsq(columns, residual, rcond=1e-6)
    return square_of(residual - columns @ sizes)
