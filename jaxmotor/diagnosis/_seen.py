"""What a recording would show of a motor with effects, and by how much it does not."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor._programs import Arrays, program
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor import Motor, Rows, Run, scan_rows, simulate_motor, warmth


@program
def residuals_program(motors: Motor, speeds: Float[Array, "batch k"], trial: Trial) -> Arrays:
    """Of each of a batch of motors whose pieces begin at `speeds`: the `plain` residual [units] and its `drift`.

    Rows come first (row, batch, lane), as they are walked through.
    """
    observed = jnp.asarray(trial.problem.lanes.observed).T

    def one(motor: Motor, speeds: Float[Array, " k"]) -> Float[Array, "row lane"]:
        return jnp.where(trial.problem.lanes.valid.T, observed - seen(motor, speeds, trial), 0.0)

    plain = jax.vmap(one, out_axes=1)(motors, speeds)
    return {"plain": plain, "drift": drift(plain, trial)}


def drift(plain: Float[Array, "row batch lane"], trial: Trial) -> Float[Array, "row batch lane"]:
    """`plain` residuals passed through 1/(1 - ρ z⁻¹), anew in each piece.

    Differences of counts hardly show a small torque, positions hardly forgive a wrong initial one; a drift over
    twenty ticks is between the two (ρ = 0: differences; ρ = 1: positions).
    """

    def row(before: Float[Array, "batch lane"], now) -> tuple[Float[Array, "batch lane"], Float[Array, "batch lane"]]:
        residual, begins = now
        after = residual + jnp.where(begins, 0.0, trial.memory)[None, :] * before
        return after, after

    return scan_rows(row, jnp.zeros_like(plain[0]), (plain, trial.problem.begins.T), trial.used)[1]


def seen(motor: Motor, speeds: Float[Array, " k"], trial: Trial) -> Float[Array, "row lane"]:
    """What the recording would show [units] of `motor` whose pieces begin at `speeds` [rad/s]."""
    run = simulated(motor, speeds, trial)
    problem = trial.problem
    if problem.kind == "turn":
        return run.seen_turn / problem.unit
    if problem.kind == "speed":
        return run.seen_speed / problem.unit
    return _mean_speed(run, trial) / problem.unit


def simulated(motor: Motor, speeds: Float[Array, " k"], trial: Trial) -> Run:
    """Of all lanes (row, lane)."""
    lanes = trial.problem.lanes
    duration = jnp.asarray(lanes.duration)
    rows = Rows(
        jnp.asarray(lanes.volts),
        jnp.asarray(lanes.reset),
        jnp.asarray(lanes.free) * speeds[lanes.piece],
        trial.time,
        trial.angle,
        _warmth(motor, trial),
    )

    def lane(rows: Rows, duration: Float[Array, "*n"]) -> Run:
        return simulate_motor(motor, rows, duration, trial.supply, trial.steps, used=trial.used, lengths=trial.lengths)

    return jax.vmap(lane, (0, None if duration.ndim == 0 else 0), 1)(rows, duration)


def _warmth(motor: Motor, trial: Trial) -> Float[Array, "lane row"] | None:
    """Lanes do not hold experiments in their order; what is warm is followed through the log instead."""
    rise = warmth(motor, trial.log)
    return None if rise is None else rise[trial.row]


def _mean_speed(run: Run, trial: Trial) -> Float[Array, "row lane"]:
    """Mean over the window before each row; within the row in which it begins the speed is a straight line."""
    lanes, window = trial.problem.lanes, trial.problem.window
    angle = jnp.cumsum(run.seen_turn, axis=0) - run.seen_turn
    first = jnp.arange(angle.shape[0], dtype=jnp.int32)[:, None] - jnp.asarray(lanes.back, jnp.int32).T

    def at_first(values: Float[Array, "row lane"]) -> Float[Array, "row lane"]:
        return jnp.take_along_axis(values, first, axis=0)

    duration = jnp.broadcast_to(jnp.asarray(lanes.duration).T, angle.shape)
    begin, turn, part = at_first(run.seen_speed), at_first(run.seen_turn), jnp.asarray(lanes.part).T
    share = part / at_first(duration)
    inside = part * begin + share**2 * (turn - begin * at_first(duration))
    return (angle - at_first(angle) - inside) / window
