"""Exact motion of the linear part over a step of constant voltage and torque, as one matrix.

With β the share of viscous friction in the pole (β = b R/(b R + Kt²)) and q the current times the resistance [V],

    w' = a (K q - |K| f) - a β w - ρ (Ω² φ + 2 ζ Ω (w - w2)) - ρ s         τ q' = e - q - (1 - β)/K w
    w2' = Ω² φ + 2 ζ Ω (w - w2) + s                                    φ' = w - w2

for an effective voltage e [V], a torque f [V] and, behind a gap, an acceleration s of the load. Without lag (τ = 0) q
is e - (1 - β)/K w and no state; without load the second line is absent.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxmotor.motor._linear import AbstractLinearMotor
from jaxmotor.motor.effects._base import Load, Scalar

Matrix = Float[Array, "_ _ ..."]
Cells = tuple[tuple[Scalar, ...], ...]
"""The numbers of a matrix, row by row."""
HALVINGS, TERMS = 14, 8
"""Times that a matrix is halved before its exponential is a series, and terms of that: exact to rounding up to norms
of 2^14."""
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
    """Integral of the equations over `duration` h: states at its end, and the means of w and q.

    With x' = A x + B u of constant u, and φ1(z) = (exp(z) - 1)/z, φ2(z) = (exp(z) - 1 - z)/z² [Higham 2008, 10.7.4],

        x(h) = exp(Ah) x + h φ1(Ah) B u,    mean x = φ1(Ah) x + h φ2(Ah) B u.
    """
    zero = jnp.zeros_like(duration)
    states = [name for name in equations if "w" in equations[name] and not name.startswith("mean")]
    inputs = [name for name in equations if not (name in states or name.startswith("mean"))]

    def factors(rows: list[str], columns: list[str]) -> Matrix:
        return jnp.stack([jnp.stack([zero + equations[row].get(name, 0.0) for name in columns]) for row in rows])

    grown, first, second = _functions(duration * factors(states, states))
    driven = duration * factors(states, inputs)
    end = jnp.concatenate([grown + jnp.eye(len(states), dtype=zero.dtype), _product(first, driven)], axis=1)
    means = jnp.concatenate([first, _product(second, driven)], axis=1)
    shown, at_once = factors(["mean w", "mean q"], states), factors(["mean w", "mean q"], inputs)
    none = jnp.zeros_like(shown)
    return jnp.concatenate([end, _product(shown, means) + jnp.concatenate([none, at_once], axis=1)])


def _functions(matrix: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """exp(z) - 1, φ1(z) and φ2(z), from the series at z/2^s; 1 is kept apart so that no digit of it is lost.

    exp(2z) - 1 = (exp(z) - 1) (2 + exp(z) - 1),   φ1(2z) = φ1(z) (1 + exp(z))/2,   φ2(2z) = (φ1(z)² + 2 φ2(z))/4
    """
    one, part = jnp.eye(len(matrix), dtype=matrix.dtype), 0.5**HALVINGS * matrix

    def nested(k: Int[Array, ""], second: Matrix) -> Matrix:
        return 0.5 * (one + 2 / (TERMS + 1 - k) * _product(part, second))

    second = jax.lax.fori_loop(0, TERMS - 1, nested, 0.5 * (one + 1 / (TERMS + 2) * part))
    first = one + _product(part, second)

    def twice(_: Int[Array, ""], now: tuple[Matrix, Matrix, Matrix]) -> tuple[Matrix, Matrix, Matrix]:
        grown, first, second = now
        return (
            2 * grown + _product(grown, grown),
            first + 0.5 * _product(first, grown),
            0.5 * second + 0.25 * _product(first, first),
        )

    return jax.lax.fori_loop(0, HALVINGS, twice, (_product(part, first), first, second))


def _product(a: Matrix, b: Matrix) -> Matrix:
    """Column by column of `a` times row by row of `b`: small matrices side by side are multiplied in one go, which
    calls of a library for each of them would not be."""

    def outer(k: int) -> Matrix:
        return jax.lax.slice_in_dim(a, k, k + 1, axis=1) * jax.lax.slice_in_dim(b, k, k + 1, axis=0)

    return sum(map(outer, range(1, len(b))), outer(0))


def cells(matrix: Matrix) -> Cells:
    """`matrix` taken apart, once for all that its numbers are used in: an index of each use costs the tracing more."""
    return tuple(jnp.unstack(row) for row in jnp.unstack(matrix))
