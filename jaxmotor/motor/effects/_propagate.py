"""Exact motion of the linear part over a step of constant voltage and torque, as one matrix.

With β the share of viscous friction in the pole (β = b R/(b R + Kt²)) and q the current times the resistance [V],

    w' = a (K q - |K| f) - a β w - ρ (Ω² φ + 2 ζ Ω (w - w2)) - ρ s         τ q' = e - q - (1 - β)/K w
    w2' = Ω² φ + 2 ζ Ω (w - w2) + s                                    φ' = w - w2

for an effective voltage e [V], a torque f [V] and, behind a gap, an acceleration s of the load. Without lag (τ = 0) q
is e - (1 - β)/K w and no state; without load the second line is absent.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor._linear import AbstractLinearMotor
from jaxmotor.motor.effects._base import Load, Scalar

Matrix = Float[Array, "_ _ ..."]
HALVINGS, TERMS = 14, 10
SHORTEST_LAG = 1e-5
"""A lag below this [s] is interpolated between none and this one: the current's own motion is over in no time."""


def propagator(
    motor: AbstractLinearMotor,
    viscous_share: Scalar,
    lag: Scalar | None,
    load: Load | None,
    contact: Scalar | None,
    duration: Scalar,
) -> Matrix:
    """(x, e, f[, s]) -> (x after `duration`, mean speed, mean q); x = (w[, q][, w2, φ]).

    `contact` is 1 on the spring and 0 within a gap; without a gap it is None.
    """

    def over(lag: Scalar | None, has_lag: Scalar) -> Matrix:
        return _means(_equations(motor, viscous_share, lag, has_lag, load, contact), duration)

    if lag is None:
        return over(None, jnp.zeros_like(duration))
    # Side by side: compiling one exponential takes half of the time that two take.
    slow, fast = jax.vmap(over, (None, 0))(jnp.maximum(lag, SHORTEST_LAG), jnp.array([1.0, 0.0], duration.dtype))
    share = jnp.minimum(lag / SHORTEST_LAG, 1.0)
    voltage = jnp.eye(fast.shape[1], dtype=fast.dtype)[2 if load is None else 4]
    current = voltage - (1 - viscous_share) / motor.gain * fast[0]
    return slow * share + jnp.concatenate([fast[:1], current[None], fast[2:]]) * (1 - share)


Equations = dict[str, dict[str, Scalar]]
"""The factor of each state and input, by the state whose rate it adds to or the quantity that it adds to."""


def _equations(
    motor: AbstractLinearMotor,
    viscous_share: Scalar,
    lag: Scalar | None,
    has_lag: Scalar,
    load: Load | None,
    contact: Scalar | None,
) -> Equations:
    """x' of (x, e, f[, s]), and w and q of them. Where `has_lag` is 0 q follows at once, and its state stands still."""
    gain, pole, one = motor.gain, motor.pole, jnp.ones_like(motor.pole)
    back, at_once = (1 - viscous_share) / gain, 1 - has_lag
    w = {"w": -pole * (viscous_share + at_once * (1 - viscous_share)), "e": at_once * pole * gain}
    rates: Equations = {"w": w | {"f": -pole * jnp.abs(gain)}}
    shown: Equations = {"mean w": {"w": one}, "mean q": {"w": -at_once * back, "e": at_once}}
    if lag is not None:
        rates["w"]["q"], shown["mean q"]["q"] = has_lag * pole * gain, has_lag
        rates["q"] = {"w": -has_lag * back / lag, "q": -has_lag / lag, "e": has_lag / lag}
    if load is not None:
        touch = one if contact is None else contact
        push, rub = touch * load.frequency**2, touch * 2 * load.damping * load.frequency
        rates["w2"] = {"w": rub, "w2": -rub, "φ": push} | ({} if contact is None else {"s": one})
        rates["φ"] = {"w": one, "w2": -one}
        for name, factor in rates["w2"].items():
            rates["w"][name] = rates["w"].get(name, 0.0) - load.ratio * factor
    inputs = ("e", "f") if contact is None else ("e", "f", "s")
    return rates | {name: {} for name in inputs} | shown


def _means(equations: Equations, duration: Scalar) -> Matrix:
    """Integral of the equations over `duration`: states at its end, and the means of w and q."""
    names, zero = list(equations), jnp.zeros_like(duration)
    states = [name for name in names if "w" in equations[name] and not name.startswith("mean")]
    rows = [
        [equations[row].get(column, zero) * (duration if row in states else 1.0) for column in names] for row in names
    ]
    moved = _exponential(jnp.stack([jnp.stack(row) for row in rows]))
    return jnp.concatenate([moved[: len(states)], moved[-2:]])[:, :-2]


def _exponential(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """exp(M) = exp(M/2^s)^(2^s), with ten terms of the series; 1 is kept apart so that no digit of it is lost."""
    one = jnp.eye(len(matrix), dtype=matrix.dtype)
    part = matrix / 2**HALVINGS
    # Loops: a product is compiled once.
    nested = jax.lax.fori_loop(0, TERMS - 1, lambda k, x: one + part @ x / (TERMS - k), one)
    return one + jax.lax.fori_loop(0, HALVINGS, lambda _, x: 2 * x + x @ x, part @ nested)
