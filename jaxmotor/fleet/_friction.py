"""Coulomb friction and a dead zone, fitted to each motor beside gain and pole.

Free simulation (`_friction_simulation`), residuals whitened as in the trajectory fit, and a fixed number of damped
Gauss-Newton steps: a step that does not lower the sum of squares is taken back and tried shorter. The sizes are fitted
through their logarithms, from small ones, so that they stay positive.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor._precision import in_float64, to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import PROCESS_RANGE, negative_log_likelihood, solve_normal, whitened
from jaxmotor.fleet._batch import BATCH, Identified, in_turn
from jaxmotor.fleet._friction_simulation import simulate_friction
from jaxmotor.fleet._ready import Case, Ready, stack
from jaxmotor.motor import FirstOrder
from jaxmotor.prediction import Problem, start_columns

COARSE_STEPS, FINE_STEPS = 8, 6
"""Of the fit, before and after the noise is weighed anew."""
START_V = (0.1, 0.05)
"""Of friction and dead zone."""
LONGEST_STEP = 1.0
"""In the logarithms."""
SIZE = 5
"""Parameters: gain, K u0 of a voltage offset u0, and the logarithms of pole, friction and dead zone."""

Residual = Callable[[Float[Array, " p"]], Float[Array, "sequence row"]]


class FrictionFit(NamedTuple):
    """A motor with Coulomb friction and a dead zone."""

    gain: float
    pole: float
    friction_V: float
    dead_zone_V: float
    standard_error: np.ndarray
    """Of the four, in their units; scaled up where the residuals are larger than the encoder's."""
    chi2_per_sample: float

    def numbers(self) -> list[float]:
        """In the order of the results' columns."""
        values = [self.gain, self.pole, self.friction_V, self.dead_zone_V]
        return [*values, *self.standard_error.tolist(), self.chi2_per_sample]


class _Start(NamedTuple):
    """What `identify_batch` has found."""

    psi: Float[Any, "*motor p"]
    initial_speed: Float[Any, "*motor k"]
    log10_q: Float[Any, "*motor"]


@in_float64
def fit_friction(motors: list[Ready], found: list[Identified]) -> list[FrictionFit | None]:
    """Friction and dead zone of each of `motors`, at most `BATCH` of one key; None where rows have a speed window.

    It starts from what `identify_batch` has `found` of them.
    """
    problem = motors[0].case.problem
    if problem.kind == "window" or problem.batch.duration.ndim:
        return [None for _ in motors]
    given = [(motor.case, _start(one)) for motor, one in zip(motors, found, strict=True)]
    cases, starts = to_jax(stack(given, BATCH))
    results = friction_program(cases, starts, to_jax(np.int32(len(motors))))
    numbers = {name: np.asarray(value) for name, value in results.items()}
    return [
        _friction_fit(numbers["psi"][k], numbers["error"][k], float(numbers["chi2"][k])) for k in range(len(motors))
    ]


def _start(found: Identified) -> _Start:
    solution = found.estimate.solution
    psi = np.array([*np.asarray(solution.psi), *np.log(START_V)])
    return _Start(psi, np.asarray(solution.initial_speed), np.asarray(solution.log10_q))


def _friction_fit(psi: np.ndarray, error: np.ndarray, chi2: float) -> FrictionFit | None:
    if not (np.isfinite(psi).all() and np.isfinite(error).all()):
        return None
    pole, friction, dead_zone = np.exp(psi[2:]).tolist()
    scale = np.array([1.0, pole, friction, dead_zone])
    return FrictionFit(float(psi[0]), pole, friction, dead_zone, error[[0, 2, 3, 4]] * scale, chi2)


@program
def friction_program(cases: Case, starts: _Start, count: Int[Array, ""]) -> Arrays:
    """`psi`, its standard errors and chi2 of the first `count` motors of `cases`, from `starts` (motor, ...)."""
    return in_turn(lambda own: _one(own[0].problem, own[1]), (cases, starts), count)


class _State(NamedTuple):
    psi: Float[Array, " p"]
    cost: Float[Array, ""]
    damping: Float[Array, ""]


def _one(problem: Problem, start: _Start) -> Arrays:
    def left(psi: Float[Array, " p"]) -> Float[Array, "sequence row"]:
        return _left(psi, problem, start.initial_speed)

    def residual(psi: Float[Array, " p"], log10_q: Float[Array, ""]) -> Float[Array, "sequence row"]:
        return whitened(left(psi)[..., None], start_columns(psi[:3], problem), 10**log10_q, problem)[0][..., 0]

    # First as noisy as the linear motor left it, then as quiet as the better model leaves it.
    psi, log10_q = _descend(start.psi, lambda psi: residual(psi, start.log10_q), COARSE_STEPS), start.log10_q
    if problem.kind == "turn":
        log10_q = _process_term(left(psi), psi, problem)
    psi = _descend(psi, lambda psi: residual(psi, log10_q), FINE_STEPS)
    jacobian = jax.jacfwd(lambda psi: residual(psi, log10_q))(psi)
    normal = jnp.einsum("lrp,lrq->pq", jacobian, jacobian)
    count = jnp.asarray(problem.batch.valid).sum().astype(psi.dtype)
    variance = jnp.maximum((residual(psi, log10_q) ** 2).sum() / (count - SIZE), 1.0)
    error = jnp.sqrt(jnp.diag(solve_normal(normal, jnp.eye(SIZE, dtype=psi.dtype))) * variance)
    chi2 = (left(psi) ** 2).sum() / count / problem.floor
    return {"psi": psi, "error": error, "chi2": chi2}


def _process_term(left: Float[Array, "sequence row"], psi: Float[Array, " p"], problem: Problem) -> Float[Array, ""]:
    """The most likely of a row of process terms for the residual `left` [decades of the floor]."""
    starts = start_columns(psi[:3], problem)
    points = jnp.linspace(*PROCESS_RANGE, 2 * int(PROCESS_RANGE[1] - PROCESS_RANGE[0]) + 1, dtype=psi.dtype)
    cost = jax.lax.map(lambda log10_q: negative_log_likelihood(log10_q, left[..., None], starts, problem), points)
    return points[jnp.argmin(cost)]


def _descend(psi: Float[Array, " p"], residual: Residual, steps: int) -> Float[Array, " p"]:
    def both(psi):
        left = residual(psi)
        return left, left

    def step(_, state: _State) -> _State:
        jacobian, left = jax.jacfwd(both, has_aux=True)(state.psi)
        normal = jnp.einsum("lrp,lrq->pq", jacobian, jacobian)
        right = jnp.einsum("lrp,lr->p", jacobian, left)
        damped = normal + state.damping * jnp.diag(jnp.diag(normal))
        delta = solve_normal(damped, right)
        logs = jnp.clip(delta[2:], -LONGEST_STEP, LONGEST_STEP)
        psi = state.psi - jnp.concatenate([delta[:2], logs])
        cost = (residual(psi) ** 2).sum()
        better = cost <= state.cost
        return _State(
            jnp.where(better, psi, state.psi),
            jnp.where(better, cost, state.cost),
            jnp.where(better, state.damping / 10, jnp.maximum(state.damping, 1e-4) * 10),
        )

    start = _State(psi, (residual(psi) ** 2).sum(), jnp.full((), 1e-3, psi.dtype))
    return jax.lax.fori_loop(0, steps, step, start).psi


def _left(psi: Float[Array, " p"], problem: Problem, initial_speed: Float[Array, " k"]) -> Float[Array, "sequence row"]:
    """Observed minus simulated [units], zero where nothing was measured."""
    pole, friction, dead_zone = jnp.exp(psi[2:])
    batch = problem.batch
    volts = jnp.asarray(batch.volts) + psi[1] / psi[0]
    # After a lost tick, the speed that the linear motor had there; what that is off by is projected out.
    speed = jnp.asarray(batch.free) * initial_speed[batch.piece]
    motor, reset, duration = FirstOrder(psi[0], pole), jnp.asarray(batch.reset), jnp.asarray(batch.duration)
    run = simulate_friction(motor, friction, dead_zone, volts.T, reset.T, speed.T, duration)
    shown = (run.turn if problem.kind == "turn" else run.speed).T / problem.unit
    return jnp.where(jnp.asarray(batch.valid), jnp.asarray(batch.observed) - shown, 0.0)
