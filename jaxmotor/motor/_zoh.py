"""Sampled response of a motor to a held input: exact, and as the paper approximates it.

The board holds a voltage for a period T, z = exp(jωT). With the exact hold x+ = A x + B u, dθ = C x + D u:

    speed at the tick           W(z) = [1 0] (z - A)⁻¹ B
    mean speed over the tick    V(z) = (C (z - A)⁻¹ B + D)/T        what a count difference is
    position at the tick        Θ(z) = T/(z - 1) V(z)

Nothing is approximated and no aliasing is left out. The paper multiplies G(jω) by the continuous factor of
the hold (eq. 4) and reads the speed from the difference to the *previous* count, z⁻¹ V(z). To second order in
ωT that is G(jω) ZOH(jω) exp(-jωT/2): a further lag of ωT/2 which its model lacks.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from jaxmotor.motor._linear import AbstractLinearMotor, Hold


def hold_switched(motor: AbstractLinearMotor, part: Float[Array, ""], period: Float[Array, ""]) -> tuple[Hold, Hold]:
    """One tick of `period` [s] in which the new voltage arrives `part` [s] after its begin.

    Returns the tick's `Hold` with respect to the old voltage and to the new one; both have the same
    transition and turn.
    """
    old, new = motor.hold(part), motor.hold(period - part)
    transition = new.transition @ old.transition
    turn = old.turn + new.turn @ old.transition
    before = Hold(transition, new.transition @ old.drive, turn, old.turn_drive + new.turn @ old.drive)
    return before, Hold(transition, new.drive, turn, new.turn_drive)


def mean_speed_response(
    motor: AbstractLinearMotor,
    frequency_Hz: Float[Array, " f"],
    period: Float[Array, ""],
    delay: Float[Array, ""] | float = 0.0,
) -> Complex[Array, " f"]:
    """V(z) [rad/s/V]: mean speed over the tick that holds the voltage, exact for any `delay` >= 0 [s]."""
    ticks = jnp.asarray(delay, dtype=period.dtype) / period
    whole = jnp.floor(ticks)
    old, new = map(_complex_hold, hold_switched(motor, (ticks - whole) * period, period))

    def at(frequency: Float[Array, ""]) -> Complex[Array, ""]:
        z, late = phasor(frequency * period), phasor(-frequency * period * whole)
        state = _resolvent(new.transition, z, old.drive / z + new.drive)
        return late * (new.turn @ state + old.turn_drive / z + new.turn_drive) / to_complex(period)

    return jax.vmap(at)(frequency_Hz)


def position_response(
    motor: AbstractLinearMotor, frequency_Hz: Float[Array, " f"], period: Float[Array, ""]
) -> Complex[Array, " f"]:
    """Θ(z) [rad/V]: shaft angle at the tick."""
    z = phasor(frequency_Hz * period)
    return mean_speed_response(motor, frequency_Hz, period) * to_complex(period) / (z - 1)


def speed_response(
    motor: AbstractLinearMotor,
    frequency_Hz: Float[Array, " f"],
    period: Float[Array, ""],
    window: Float[Array, ""] | float = 0.0,
) -> Complex[Array, " f"]:
    """Response [rad/s/V] of a logged speed that is the mean over `window` [s] before the tick; 0 is W(z).

    The window begins m ticks back, a part f into that tick: (Θ - z⁻ᵐ (Θ + what the hold turns in f))/window.
    """
    window = jnp.asarray(window, dtype=period.dtype)
    back = jnp.ceil(window / period - 1e-9)
    tick = _complex_hold(motor.hold(period))
    part = _complex_hold(motor.hold(jnp.maximum(back * period - window, 0.0)))
    length = to_complex(jnp.where(window > 0, window, 1.0))

    def at(frequency: Float[Array, ""]) -> Complex[Array, ""]:
        z, late = phasor(frequency * period), phasor(-frequency * period * back)
        state = _resolvent(tick.transition, z, tick.drive)
        angle = (tick.turn @ state + tick.turn_drive) / (z - 1)
        begin = late * (angle + part.turn @ state + part.turn_drive)
        return jnp.where(window > 0, (angle - begin) / length, state[0])

    return jax.vmap(at)(frequency_Hz)


def paper_response(
    motor: AbstractLinearMotor, frequency_Hz: Float[Array, " f"], period: Float[Array, ""]
) -> Complex[Array, " f"]:
    """G(jω) ZOH(jω) [rad/s/V], the paper's model of the sampled motor (eq. 4 and 11)."""
    return motor.transfer(2j * jnp.pi * to_complex(frequency_Hz)) * zoh_factor(frequency_Hz, period)


def zoh_factor(frequency_Hz: Float[Array, " f"], period: Float[Array, ""]) -> Complex[Array, " f"]:
    """ZOH(jω) = (1 - exp(-jωT))/(jωT) [1], the paper's eq. 4; 1 at frequency zero."""
    turns = frequency_Hz * period
    return to_complex(jnp.sinc(turns)) * phasor(-turns / 2)


def unmodelled_by_paper(
    motor: AbstractLinearMotor, frequency_Hz: Float[Array, " f"], period: Float[Array, ""]
) -> Complex[Array, " f"]:
    """Ratio of what the paper's processing sees, z⁻¹ V(z), to what its model says, G(jω) ZOH(jω)."""
    seen = mean_speed_response(motor, frequency_Hz, period) * phasor(-frequency_Hz * period)
    return seen / paper_response(motor, frequency_Hz, period)


def step_response(motor: AbstractLinearMotor, time: Float[Array, " n"], volts: Float[Array, ""]) -> Float[Array, " n"]:
    """Speed [rad/s] at `time` [s] after a step of `volts` [V] from rest; exact."""
    return jax.vmap(lambda t: motor.hold(t).drive[0] * volts)(time)


def to_complex(x: Float[Array, "*shape"]) -> Complex[Array, "*shape"]:
    """`x` as complex numbers of the same precision."""
    return jax.lax.complex(x, jnp.zeros_like(x))


def phasor(turns: Float[Array, "*shape"]) -> Complex[Array, "*shape"]:
    """exp(2πj `turns`)."""
    return jax.lax.complex(jnp.cos(2 * jnp.pi * turns), jnp.sin(2 * jnp.pi * turns))


def _complex_hold(hold: Hold) -> Hold:
    return Hold(*map(to_complex, hold))


def _resolvent(
    transition: Complex[Array, "n n"], z: Complex[Array, ""], drive: Complex[Array, " n"]
) -> Complex[Array, " n"]:
    """(z - A)⁻¹ b, written out for the two orders there are."""
    if drive.shape[0] == 1:
        return drive / (z - transition[0, 0])
    (a, b), (c, d) = transition
    determinant = (z - a) * (z - d) - b * c
    return jnp.stack([(z - d) * drive[0] + b * drive[1], c * drive[0] + (z - a) * drive[1]]) / determinant
