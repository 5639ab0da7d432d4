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
SHORTEST_LAG = 1e-5
"""A lag below this [s] is interpolated between none and this one: the current's own motion is over in no time."""


def propagator(
    motor: AbstractLinearMotor,
    viscous_share: Scalar,
    lag: Scalar | None,
    load: Load | None,
    in_contact: bool,
    duration: Scalar,
) -> Matrix:
    """(x, e, f[, s]) -> (x after `duration`, mean speed, mean q); x = (w[, q][, w2, φ])."""
    if lag is None:
        return _means(*_equations(motor, viscous_share, None, load, in_contact), duration, 6)
    slow = _means(*_equations(motor, viscous_share, jnp.maximum(lag, SHORTEST_LAG), load, in_contact), duration, 14)
    fast = _means(*_equations(motor, viscous_share, None, load, in_contact), duration, 6)
    share = jnp.minimum(lag / SHORTEST_LAG, 1.0)
    return slow * share + _with_current(fast, motor, viscous_share) * (1 - share)


def _equations(
    motor: AbstractLinearMotor, viscous_share: Scalar, lag: Scalar | None, load: Load | None, in_contact: bool
) -> tuple[Matrix, Matrix]:
    """x' of (x, e, f[, s]), and (w, q) of them."""
    gain, pole = motor.gain, motor.pole
    back = (1 - viscous_share) / gain
    states = 1 + (lag is not None) + 2 * (load is not None)
    columns = states + 2 + (load is not None and load.gap is not None)
    rate = jnp.zeros((states, columns), pole.dtype)
    shown = jnp.zeros((2, columns), pole.dtype).at[0, 0].set(1.0)
    rate = rate.at[0, states + 1].set(-pole * jnp.abs(gain))
    if lag is None:
        shown = shown.at[1, 0].set(-back).at[1, states].set(1.0)
        rate = rate.at[0, 0].set(-pole).at[0, states].set(pole * gain)
    else:
        shown = shown.at[1, 1].set(1.0)
        rate = rate.at[0, :2].set(jnp.stack([-pole * viscous_share, pole * gain]))
        rate = rate.at[1, :2].set(jnp.stack([-back, -jnp.ones_like(back)]) / lag).at[1, states].set(1 / lag)
    if load is not None:
        speed, twist = states - 2, states - 1
        rate = rate.at[twist, 0].set(1.0).at[twist, speed].set(-1.0)
        if in_contact:
            push, rub = load.frequency**2, 2 * load.damping * load.frequency
            rate = rate.at[speed, 0].set(rub).at[speed, speed].set(-rub).at[speed, twist].set(push)
            rate = rate.at[0].add(-load.ratio * rate[speed])
        if load.gap is not None:
            rate = rate.at[speed, -1].set(1.0).at[0, -1].set(-load.ratio)
    return rate, shown


def _means(rate: Matrix, shown: Matrix, duration: Scalar, halvings: int) -> Matrix:
    """Integral of x' = `rate` z over `duration`, and the mean of `shown` z."""
    states, columns = rate.shape
    size = columns + 2
    step = jnp.zeros((size, size), rate.dtype)
    step = step.at[:states, :columns].set(rate * duration).at[columns:, :columns].set(shown)
    moved = _exponential(step, halvings)
    return jnp.concatenate([moved[:states, :columns], moved[columns:, :columns]])


def _exponential(matrix: Float[Array, "n n"], halvings: int) -> Float[Array, "n n"]:
    """exp(M) = exp(M/2^s)^(2^s), with ten terms of the series; 1 is kept apart so that no digit of it is lost."""
    one = jnp.eye(len(matrix), dtype=matrix.dtype)
    part = matrix / 2**halvings
    nested = one
    for k in range(10, 1, -1):
        nested = one + part @ nested / k
    return one + jax.lax.fori_loop(0, halvings, lambda _, x: 2 * x + x @ x, part @ nested)


def _with_current(fast: Matrix, motor: AbstractLinearMotor, viscous_share: Scalar) -> Matrix:
    """The lagless matrix `fast` with a state q more, which is e - (1 - β)/K w at the end and does nothing else."""
    columns = fast.shape[1]
    states = fast.shape[0] - 2
    current = (-(1 - viscous_share) / motor.gain * fast[0]).at[states].add(1.0)
    rows = jnp.concatenate([fast[:1], current[None], fast[1:]])
    return jnp.concatenate([rows[:, :1], jnp.zeros((len(rows), 1), fast.dtype), rows[:, 1:columns]], axis=1)
