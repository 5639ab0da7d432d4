"""Standard errors that do not rest on the model being perfect.

With H = JᵀJ + vP (P the precision of priors and ties, v the variance that it is weighed against) and g_c the sum of
Jᵀr over block c of the recording, the covariance is the larger, parameter by parameter, of H⁻¹ (residuals independent,
of unit variance; a law's `unlikeness` makes it more, and its `unlikeness_beside` that of others) and of the sandwich
H⁻¹ (Σ g_c g_cᵀ G/(G - 1) + v²P) H⁻¹ (only blocks are independent) [White 1980; Liang and Zeger 1986].
"""

import math

import numpy as np
from jaxtyping import Float

from jaxmotor._balanced import balanced
from jaxmotor.diagnosis._free import OWN
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.motor.effects import AbstractEffect, Rig, free_size, parameters

NO_VARIANCE = 1e-12
"""Part of the variance by independent residuals below which blocks say nothing of a parameter."""
APART = 5.0
"""Standard errors by which motors differ that are not one: they are fitted less patiently while they are compared."""


def covariance(fitted: Fitted, block: np.ndarray) -> Float[np.ndarray, "p p"]:
    """Of the free numbers of `fitted`, whose rows belong to blocks `block` (n,); inf on the diagonal of any unknown."""
    layout = fitted.layout
    prior = np.diag(1 / layout.spread**2)
    if layout.ties is not None:
        prior += layout.ties.T @ layout.ties
    shows = fitted.jacobian.any(axis=0) | (np.diag(prior) > 0)
    known = np.isfinite(fitted.jacobian).all(axis=0) & shows
    jacobian = np.where(known, fitted.jacobian, 0.0)
    bread = _inverse(jacobian.T @ jacobian + prior)
    used, index = np.unique(block, return_inverse=True)
    pulls = np.stack([np.bincount(index, column * fitted.residual) for column in jacobian.T], axis=1)
    blocks = len(used)
    meat = pulls.T @ pulls * (blocks / max(blocks - 1, 1)) + fitted.variance * prior
    sandwich = bread @ meat @ bread
    unlike = np.concatenate([np.ones(OWN), *_unlikeness(fitted.template.effects)])
    own = bread * max(fitted.chi2, 1.0) * np.outer(unlike, unlike)
    none = np.diag(sandwich) <= NO_VARIANCE * np.diag(own)
    grow = np.sqrt(np.maximum(np.diag(own) / np.where(none, np.diag(own) + 1e-300, np.diag(sandwich)), 1.0))
    larger = np.where(np.add.outer(none, none), own, sandwich * np.outer(grow, grow))
    return larger + np.diag(np.where(known, 0.0, np.inf))


def _unlikeness(effects: tuple[AbstractEffect, ...]) -> list[np.ndarray]:
    """Of the free numbers of each of `effects`: its own, or that of a law beside it."""
    found = []
    for one in effects:
        others = [type(other).unlikeness_beside for other in effects if other is not one]
        found.append(np.full(free_size(one), max([type(one).unlikeness, *others])))
    return found


def _inverse(normal: np.ndarray) -> np.ndarray:
    ones, scale = balanced(normal)
    return np.linalg.pinv(ones, rcond=1e-12, hermitian=True) / np.outer(scale, scale)


def differs(fitted: Fitted, spread: Float[np.ndarray, "p p"], other: Fitted) -> np.ndarray:
    """(2,) whether gain and pole of `other` are others than those of `fitted`."""
    return np.abs(other.free[:2] - fitted.free[:2]) > APART * np.sqrt(np.diag(spread)[:2])


def with_indistinguishable(
    fitted: Fitted, spread: Float[np.ndarray, "p p"], alike: list[Fitted]
) -> Float[np.ndarray, "p p"]:
    """`spread`, wider where `alike`, motors that explain the recording as well, have another gain or pole.

    Either may be the true one: a difference d adds d²/2 to the variance.
    """
    away = [np.where(differs(fitted, spread, other), other.free[:2] - fitted.free[:2], 0.0) for other in alike]
    wider = spread.copy()
    wider[[0, 1], [0, 1]] += np.max([np.zeros(2), *np.square(away)], axis=0) / 2
    return wider


def at_least(spread: Float[np.ndarray, "p p"], known: Float[np.ndarray, " 2"]) -> Float[np.ndarray, "p p"]:
    """`spread`, grown where the relative errors of gain and pole are below the `known` ones."""
    grow = np.ones(len(spread))
    grow[:2] = np.maximum(known / np.sqrt(np.diag(spread)[:2]), 1.0)
    return spread * np.outer(grow, grow)


def linear_errors(fitted: Fitted, spread: np.ndarray) -> dict[str, float]:
    """Standard errors of gain [rad/s/V], pole [rad/s], L/R [s] and the viscous share [1]."""
    error = np.sqrt(np.diag(spread))
    motor = fitted.motor
    # A load's share of the inertia that is not quite right makes the rotor's, and so the pole, wrong by about half.
    rough = max((type(effect).roughness for effect in motor.effects), default=0.0)
    return {
        "gain_rad_s_V": abs(float(motor.linear.gain)) * float(error[0]),
        "pole_rad_s": float(motor.linear.pole) * math.hypot(float(error[1]), 0.5 * rough),
        "electrical_time_constant_s": float(error[2]),
        "viscous_share": float(error[3]),
    }


def linear_covariance(fitted: Fitted, spread: np.ndarray) -> Float[np.ndarray, "3 3"]:
    """Of gain [rad/s/V], pole [rad/s] and L/R [s], with `linear_errors` on its diagonal."""
    motor = fitted.motor
    slope = np.array([float(motor.linear.gain), float(motor.linear.pole), 1.0])
    together = spread[:3, :3] * np.outer(slope, slope)
    errors = list(linear_errors(fitted, spread).values())[:3]
    np.fill_diagonal(together, np.square(errors))
    return together


def effect_errors(fitted: Fitted, spread: np.ndarray, rig: Rig) -> tuple[dict[str, float], ...]:
    """Of each effect, the standard error of each parameter in its unit."""
    at, found = OWN, []
    for effect in fitted.motor.effects:
        slopes = slopes_of(effect, at, len(spread)).items()
        found.append({name: _error(effect, name, slope, spread, rig) for name, slope in slopes})
        at += free_size(effect)
    return tuple(found)


def _error(effect: AbstractEffect, name: str, slope: np.ndarray, spread: np.ndarray, rig: Rig) -> float:
    about, value, used = parameters(effect)[name], float(getattr(effect, name)), slope != 0
    error = math.sqrt(slope[used] @ spread[np.ix_(used, used)] @ slope[used])
    if about["kind"] == "fixed" and about["unit"] == "V":
        # Known to lie between two of the voltages that were applied; a whole number is known.
        error = _gap(rig, value) / math.sqrt(12)
    return math.hypot(error, type(effect).roughness * abs(value))


def slopes_of(effect: AbstractEffect, at: int, width: int) -> dict[str, Float[np.ndarray, " p"]]:
    """Of each parameter with respect to the free numbers (p,), of which the effect's own begin at `at`."""
    unit, slopes = np.eye(width), {name: np.zeros(width) for name in parameters(effect)}
    for name, about in parameters(effect).items():
        value = float(getattr(effect, name))
        if about["kind"] in ("positive", "signed", "term"):
            slopes[name] = unit[at] * (value if about["kind"] == "positive" else 1.0)
            if "least" in about:
                slopes[name] += slopes[about["least"]] * (value / float(getattr(effect, about["least"])))
            at += 1
        elif about["kind"] == "amplitude":
            phase = float(effect.phase_rad)  # pyright: ignore[reportAttributeAccessIssue]
            slopes[name] = math.cos(phase) * unit[at] + math.sin(phase) * unit[at + 1]
            across = math.cos(phase) * unit[at + 1] - math.sin(phase) * unit[at]
            slopes["phase_rad"] = across / max(value, 1e-300)
            at += 2
    return slopes


def _gap(rig: Rig, volts: float) -> float:
    levels = np.array([0.0, *rig.volts_V])
    above = int(np.clip(np.searchsorted(levels, volts), 1, len(levels) - 1))
    return float(levels[above] - levels[above - 1])
