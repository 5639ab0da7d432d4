"""Linear motors: equations and their exact propagation under a held voltage.

The paper's eq. 9 has five parameters, of which voltage and speed alone show three. Written with the
gain K [rad/s/V], the pole a [rad/s] and the electrical time constant τ = L/R [s] it is

    a first order   w' = a (K u - w)                                  G(s) = K a/(s + a)            (eq. 11)
    a second order  w' = a m,   τ m' = K u - w - m                    G(s) = K a/(τ s² + s + a)     (eq. 9)

where m [rad/s] is the torque as the speed it would hold against the back-EMF. The first is the second's
limit τ -> 0. (Eq. 9 with viscous friction b has (1 + τ b/J) s in the middle: a few per mille of τ, which
voltage and speed cannot separate from τ and a.)
"""

import abc
import functools
from collections.abc import Iterable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from jaxmotor._precision import to_jax
from jaxmotor.motor._readable import readable

SHORT, TERMS = 2.0, 24
"""A hold of up to so many time constants, a + 2/τ over one, is summed as a series of so many terms."""


class Hold(NamedTuple):
    """What a voltage u [V] held for a time does to a motor of n states x, whose first is the speed [rad/s].

    x becomes `transition` x + `drive` u, and the shaft turns by `turn` x + `turn_drive` u [rad].
    """

    transition: Float[Array, "n n"]
    drive: Float[Array, " n"]
    turn: Float[Array, " n"]
    turn_drive: Float[Array, ""]


class AbstractLinearMotor(eqx.Module):
    """A linear motor from bridge voltage [V] to output speed [rad/s]."""

    gain: eqx.AbstractVar[Float[Array, ""]]
    pole: eqx.AbstractVar[Float[Array, ""]]

    __repr__ = readable

    @property
    @abc.abstractmethod
    def order(self) -> int:
        """Number of states n."""

    @abc.abstractmethod
    def hold(self, duration: Float[Array, ""]) -> Hold:
        """Exact effect of a voltage held for `duration` [s]."""

    @abc.abstractmethod
    def transfer(self, s: Complex[Array, " f"]) -> Complex[Array, " f"]:
        """G(s) [rad/s/V] at complex frequencies `s` [rad/s]."""


class FirstOrder(AbstractLinearMotor):
    """w' = a (K u - w), the paper's eq. 11."""

    gain: Float[Array, ""]
    """K [rad/s/V]."""
    pole: Float[Array, ""]
    """a [rad/s]."""

    @property
    def order(self) -> int:
        return 1

    def hold(self, duration: Float[Array, ""]) -> Hold:
        """With p = exp(-a T):  w+ = p w + K (1 - p) u,  dθ = (1 - p)/a w + K (T - (1 - p)/a) u."""
        lost = -jnp.expm1(-self.pole * duration)
        coast = lost / self.pole
        return Hold((1 - lost)[None, None], (self.gain * lost)[None], coast[None], self.gain * (duration - coast))

    def transfer(self, s: Complex[Array, " f"]) -> Complex[Array, " f"]:
        gain, pole = (jax.lax.complex(x, jnp.zeros_like(x)) for x in (self.gain, self.pole))
        return gain * pole / (s + pole)


class SecondOrder(AbstractLinearMotor):
    """w' = a m, τ m' = K u - w - m, the paper's eq. 9 in the parameters that can be measured."""

    gain: Float[Array, ""]
    """K [rad/s/V]."""
    pole: Float[Array, ""]
    """a [rad/s], the mechanical pole that is left when τ vanishes."""
    electrical_time_constant: Float[Array, ""]
    """τ = L/R [s]."""

    @property
    def order(self) -> int:
        return 2

    def hold(self, duration: Float[Array, ""]) -> Hold:
        """x' = M x + (0, K/τ) u with M = [[0, a], [-1/τ, -1/τ]], in closed form.

        A hold that is short beside both time constants is summed as a series: there the closed form
        is a difference of nearly equal numbers.
        """
        short = (self.pole + 2 / self.electrical_time_constant) * duration < SHORT
        pairs = zip(self._short_hold(duration), self._long_hold(duration), strict=True)
        return Hold(*(jnp.where(short, series, closed) for series, closed in pairs))

    def _long_hold(self, duration: Float[Array, ""]) -> Hold:
        """With y = (w - K u, m): y+ = exp(M T) y, and its integral is M⁻¹ (exp(M T) - 1) y."""
        a, tau, gain = self.pole, self.electrical_time_constant, self.gain
        half = 0.5 / tau
        even, odd = _damped_pair(half, a / tau, duration)
        lost = _lost(half, a / tau, duration, even + odd * half)
        e11, e12 = 1 - lost, odd * a
        e21, e22 = -odd / tau, even - odd * half
        turn_speed = lost / a - tau * e21
        turn_torque = -e12 / a - tau * (e22 - 1)
        return Hold(
            jnp.stack([jnp.stack([e11, e12]), jnp.stack([e21, e22])]),
            gain * jnp.stack([lost, -e21]),
            jnp.stack([turn_speed, turn_torque]),
            gain * (duration - turn_speed),
        )

    def _short_hold(self, duration: Float[Array, ""]) -> Hold:
        """φ2 = Σ (M T)^k/(k+2)!, φ1 = 1 + M T φ2, exp(M T) = 1 + M T φ1; `TERMS` reach double precision."""
        a, lag = self.pole * duration, duration / self.electrical_time_constant
        limited = SHORT / jnp.maximum(a + 2 * lag, SHORT)  # keeps the branch not taken finite
        a, lag = a * limited, lag * limited
        step = jnp.stack([jnp.stack([jnp.zeros_like(a), a]), jnp.stack([-lag, -lag])])
        one = jnp.eye(2, dtype=step.dtype)
        # A loop: unrolled it would take longer to compile than all else in a prediction.
        nested = jax.lax.fori_loop(0, TERMS, lambda k, x: one + step @ x / (TERMS + 2 - k), one)
        phi2 = nested / 2
        phi1 = one + step @ phi2
        drive = self.gain * lag
        return Hold(one + step @ phi1, phi1[:, 1] * drive, duration * phi1[0], duration * phi2[0, 1] * drive)

    def transfer(self, s: Complex[Array, " f"]) -> Complex[Array, " f"]:
        values = (self.gain, self.pole, self.electrical_time_constant)
        gain, pole, tau = (jax.lax.complex(x, jnp.zeros_like(x)) for x in values)
        return gain * pole / (tau * s**2 + s + pole)


def linear_motor(values: Iterable[float]) -> FirstOrder | SecondOrder:
    """The motor whose gain [rad/s/V], pole [rad/s] and, if given, electrical time constant [s] are `values`.

    Its leaves are numpy's, so that it keeps its 64 bits wherever it goes.
    """
    numbers = [np.asarray(value, np.float64) for value in values]
    return jax.tree.unflatten(_tree(len(numbers)), numbers)


@functools.cache
def _tree(size: int) -> Any:
    """How a motor of `size` parameters is put together."""
    ones = to_jax([1.0] * size)
    return jax.tree.structure(FirstOrder(*ones) if size == 2 else SecondOrder(*ones))


def _lost(
    half_rate: Float[Array, ""], stiffness: Float[Array, ""], time: Float[Array, ""], kept: Float[Array, ""]
) -> Float[Array, ""]:
    """1 - `kept`, the part of the speed that is lost in `time` [s].

    With real poles p < q it is (q (1 - exp(-p t)) - p (1 - exp(-q t)))/(q - p): of a slow motor 1 - `kept` would be a
    difference of nearly equal numbers.
    """
    square = half_rate**2 - stiffness
    real = square * time**2 > 1e-4
    root = jnp.sqrt(jnp.where(real, square, 1 / time**2))
    fast = half_rate + root
    slow = stiffness / fast
    apart = -fast * jnp.expm1(-slow * time) + slow * jnp.expm1(-fast * time)
    return jnp.where(real, apart / (2 * root), 1 - kept)


def _damped_pair(
    half_rate: Float[Array, ""], stiffness: Float[Array, ""], time: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """exp(-h t) cosh(r t) and exp(-h t) sinh(r t)/r with r² = h² - `stiffness`, for either sign of r².

    Exact and differentiable also where r vanishes (critical damping), and free of overflow for large h t.
    """
    square = half_rate**2 - stiffness
    small = jnp.abs(square) * time**2 < 1e-4
    # Each branch sees an argument it likes: a NaN in the branch not taken would spoil the gradient.
    over = jnp.where((square > 0) & ~small, square, 1 / time**2)
    under = jnp.where((square < 0) & ~small, -square, 1 / time**2)
    r, w = jnp.sqrt(over), jnp.sqrt(under)
    slow = jnp.exp(-stiffness / (half_rate + r) * time)
    fast = jnp.exp(-2 * r * time)
    decay = jnp.exp(-half_rate * time)
    x = jnp.where(small, square, 0.0) * time**2
    even = (
        jnp.where(square > 0, slow * (1 + fast) / 2, decay * jnp.cos(w * time)),
        decay * (1 + x / 2 * (1 + x / 12 * (1 + x / 30))),
    )
    odd = (
        jnp.where(square > 0, slow * (1 - fast) / (2 * r), decay * jnp.sin(w * time) / w),
        decay * time * (1 + x / 6 * (1 + x / 20 * (1 + x / 42))),
    )
    return jnp.where(small, even[1], even[0]), jnp.where(small, odd[1], odd[0])
