"""Gain and pole from the whole recording in time, by least squares on whitened residuals.

The motor is simulated freely over every segment, so nothing is differentiated and no noise enters a regressor.
Unknown are ψ = (K, b, log a [, log τ]), where b = K u0 [rad/s] is the speed of a constant voltage error u0, and the
initial speed of each piece that does not begin at rest. K, b and the initial speeds enter linearly, and with them
profiled out the cost has one minimum in log a: Gauss-Newton with the steps in the logarithms clipped to one, and the
linear unknowns at their best for the clipped step, converges from far away. Each step also chooses the process term q
of the residuals' covariance by maximum likelihood (`_whitening`).
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxmotor.estimate._whitening import whiten
from jaxmotor.prediction import Problem, is_no_average, predict

PATIENCE = 10
"""Steps after which one that takes back the last is halved."""
MAX_STEPS = 40
"""Of a fit."""
PROCESS_RANGE = (-8.0, 4.0)
"""Decades of q that are searched, in units of the floor."""
PROCESS_POINTS = 9
"""Of q that are tried at once."""


class Linearised(NamedTuple):
    """The prediction at ψ and initial speeds, and its derivatives."""

    prediction: Float[Array, "sequence row"]
    """Of all rows, also those in which nothing was measured [units]."""
    jacobian: Float[Array, "sequence row p"]
    """With respect to ψ [units]; zero where nothing was measured."""
    starts: Float[Array, "sequence row s"]
    """What one rad/s of initial speed adds to the piece it belongs to [units]; no column where all begin at rest."""

    def residual(self, problem: Problem) -> Float[Array, "sequence row"]:
        """Observed minus predicted [units], zero where nothing was measured."""
        return jnp.where(jnp.asarray(problem.batch.valid), jnp.asarray(problem.batch.observed) - self.prediction, 0.0)


class Solution(NamedTuple):
    """Where the steps ended, and the linearisation there."""

    psi: Float[Array, " p"]
    initial_speed: Float[Array, " pieces_and_one"]
    """Of each piece [rad/s]."""
    log10_q: Float[Array, ""]
    """Process term, in units of the floor."""
    residual: Float[Array, "sequence row"]
    """Observed minus simulated [units]."""
    jacobian: Float[Array, "sequence row p"]
    """Of the simulation with respect to ψ [units]."""
    steps: Int[Array, ""]
    moved: Float[Array, ""]
    """Length of the last step, in standard errors."""


def whitened(
    columns: Float[Array, "sequence row c"],
    starts: Float[Array, "sequence row s"],
    q: Float[Array, ""],
    problem: Problem,
) -> tuple[Float[Array, "sequence row c"], Float[Array, "pieces_and_one c"], Float[Array, ""]]:
    """Whitened `columns` with each piece's initial speed projected out, the speeds that did it, and log det Cov."""
    valid = jnp.asarray(problem.batch.valid)
    variance, shared = problem.floor * (1 + q), jnp.asarray(problem.shared, q.dtype)
    both = jnp.concatenate([columns, starts], axis=-1)
    both, log_det = jax.vmap(whiten, (0, 0, 0, None, None))(both, problem.begins, valid, variance, shared)
    columns, starts = both[..., : columns.shape[-1]], both[..., columns.shape[-1] :]
    if not problem.free:
        return columns, jnp.zeros((problem.pieces + 1, columns.shape[-1]), columns.dtype), log_det.sum()
    piece = jnp.asarray(problem.batch.piece)
    size = _sum_by(starts**2, piece, problem.pieces)
    speed = _sum_by(starts * columns, piece, problem.pieces) / jnp.where(size > 0, size, 1.0)
    return columns - starts * speed[piece], speed, log_det.sum()


def negative_log_likelihood(log10_q: Float[Array, ""], columns, starts, problem: Problem) -> Float[Array, ""]:
    """-2 log likelihood of q with ψ and the initial speeds at their best for it.

    `columns` are the residual and its Jacobian. Where the floor is not known its scale is profiled out, too.
    """
    white, _, log_det = whitened(columns, starts, 10**log10_q, problem)
    residual, _, _ = least_squares(white)
    count = jnp.asarray(problem.batch.valid).sum().astype(residual.dtype)
    square = (residual**2).sum()
    if problem.floor_known:
        return square + log_det
    return count * jnp.log(square / count) + log_det


def least_squares(
    white: Float[Array, "sequence row c"],
) -> tuple[Float[Array, "sequence row"], Float[Array, " p"], Float[Array, "p p"]]:
    """Residual and solution of J δ = r for `white` = [r, J], and JᵀJ; a column that is zero gets no step."""
    residual, jacobian = white[..., 0], white[..., 1:]
    normal = jnp.einsum("lrp,lrq->pq", jacobian, jacobian)
    delta = solve_normal(normal, jnp.einsum("lrp,lr->p", jacobian, residual))
    return residual - jacobian @ delta, delta, normal


def solve_normal(normal: Float[Array, "p p"], right: Float[Array, "p *c"]) -> Float[Array, "p *c"]:
    """Solution of symmetric equations whose unknowns have different units; a zero row gets a zero."""
    scale = jnp.sqrt(jnp.diag(normal))
    scale = jnp.where(scale > 0, scale, 1.0)
    balanced = normal / jnp.outer(scale, scale) + 1e-14 * jnp.eye(len(scale), dtype=normal.dtype)
    scale = scale.reshape(-1, *[1] * (right.ndim - 1))
    return _eliminated(balanced, right / scale) / scale


def _eliminated(normal: Float[Array, "p p"], right: Float[Array, "p *c"]) -> Float[Array, "p *c"]:
    """Solution of `normal` x = `right` by elimination (Gauss-Jordan): a positive definite matrix with ones on its
    diagonal needs no other order of rows. On a machine of one core XLA cannot compile loops as long as the fit's with
    calls of LAPACK in them; written out for each unknown this would be a quarter of that."""
    size, columns = len(normal), right.reshape(len(normal), math.prod(right.shape[1:]))
    if not size:
        # A loop is traced even where it has no turn.
        return right

    def without(k: Int[Array, ""], both: Float[Array, "p pc"]) -> Float[Array, "p pc"]:
        row, own = both[k] / both[k, k], jnp.arange(size) == k
        return jnp.where(own[:, None], row, both - jnp.outer(both[:, k], row))

    both = jax.lax.fori_loop(0, size, without, jnp.concatenate([normal, columns], axis=1))
    return both[:, size:].reshape(right.shape)


def _clipped(delta: Float[Array, " p"], normal: Float[Array, "p p"]) -> Float[Array, " p"]:
    """`delta` with steps in logarithms of at most one, and K and b at the best value for the step that is left."""
    logs = jnp.clip(delta[2:], -1.0, 1.0)
    linear = delta[:2] + solve_normal(normal[:2, :2], normal[:2, 2:] @ (delta[2:] - logs))
    return jnp.concatenate([linear, logs])


def evaluate(problem: Problem, psi: Float[Array, " p"]) -> Solution:
    """No step, only the residual at `psi` with the initial speeds at their best (least squares on differences)."""
    q = jnp.asarray(PROCESS_RANGE[1], psi.dtype)
    none = jnp.zeros(problem.pieces + 1, psi.dtype)
    at_rest = linearise(psi, none, problem)
    _, speeds, _ = whitened(at_rest.residual(problem)[..., None], at_rest.starts, 10**q, problem)
    at = linearise(psi, speeds[:, 0], problem)
    return Solution(psi, speeds[:, 0], q, at.residual(problem), at.jacobian, jnp.asarray(0), jnp.zeros_like(q))


class _State(NamedTuple):
    psi: Float[Array, " p"]
    initial_speed: Float[Array, " pieces_and_one"]
    log10_q: Float[Array, ""]
    width: Float[Array, ""]
    steps: Int[Array, ""]
    moved: Float[Array, ""]
    step: Float[Array, " p"]
    """The last one."""
    at: Linearised
    """From which it was taken."""


def solve(problem: Problem, psi: Float[Array, " p"]) -> tuple[Solution, Linearised]:
    """Least squares from `psi`: at most `MAX_STEPS` steps or until one is under a thousandth standard error; and the
    prediction from which the last step was taken. It is left where an average of the speeds has come to none, from
    where its logarithm would go on by one each step."""
    dtype = psi.dtype
    low, high = PROCESS_RANGE
    shape = problem.batch.volts.shape
    nothing = [jnp.zeros((*shape, *columns), dtype) for columns in ((), psi.shape, (int(problem.free),))]
    state = _State(
        psi,
        jnp.zeros(problem.pieces + 1, dtype),
        jnp.asarray((low + high) / 2, dtype),
        jnp.asarray((high - low) / 2, dtype),
        jnp.asarray(0),
        jnp.asarray(jnp.inf, dtype),
        jnp.zeros_like(psi),
        Linearised(*nothing),
    )

    def unfinished(state: _State) -> Bool[Array, ""]:
        return (state.steps < MAX_STEPS) & ~(state.moved < 1e-3) & ~is_no_average(state.psi, problem)

    last = jax.lax.while_loop(unfinished, lambda state: _step(state, problem), state)
    residual, jacobian = last.at.residual(problem), last.at.jacobian
    return Solution(last.psi, last.initial_speed, last.log10_q, residual, jacobian, last.steps, last.moved), last.at


def _step(before: _State, problem: Problem) -> _State:
    """Linearise, choose q, move."""
    at = linearise(before.psi, before.initial_speed, problem)
    columns = jnp.concatenate([at.residual(problem)[..., None], at.jacobian], axis=-1)
    log10_q, width = _process_term(before.log10_q, before.width, columns, at.starts, problem)
    white, speeds, _ = whitened(columns, at.starts, 10**log10_q, problem)
    _, delta, normal = least_squares(white)
    step = _clipped(delta, normal)
    step = jnp.where(before.steps < PATIENCE, step, _halved(step, before.step, normal))
    initial_speed = before.initial_speed + speeds[:, 0] - speeds[:, 1:] @ step
    moved = jnp.sqrt((jnp.einsum("lrp,p->lr", white[..., 1:], delta) ** 2).sum())
    # The process term's bracket must have closed, too, before a small step means the end.
    moved = jnp.where(width < 0.05, moved, jnp.inf)
    return _State(before.psi + step, initial_speed, log10_q, width, before.steps + 1, moved, step, at)


def _halved(step: Float[Array, " p"], last: Float[Array, " p"], normal: Float[Array, "p p"]) -> Float[Array, " p"]:
    """Half a `step` that takes back most of the `last` one, where steps would go to and fro without an end."""
    back = -(step @ normal @ last) > 0.5 * (last @ normal @ last)
    return jnp.where(back, 0.5 * step, step)


def linearise(psi: Float[Array, " p"], initial_speed: Float[Array, " k"], problem: Problem) -> Linearised:
    """The prediction at `psi`, in one simulation with its derivatives: a second one would take as long to compile."""
    size = len(psi)

    def twice(values):
        prediction = predict(values[:size], initial_speed + values[size:].sum(), problem)
        return prediction, prediction

    none = jnp.zeros(int(problem.free), psi.dtype)
    columns, prediction = jax.jacfwd(twice, has_aux=True)(jnp.concatenate([psi, none]))
    jacobian, starts = columns[..., :size], columns[..., size:]
    if problem.held is not None:
        jacobian = jnp.where(problem.held[None, None, :], 0.0, jacobian)
    return Linearised(prediction, jnp.where(jnp.asarray(problem.batch.valid)[..., None], jacobian, 0.0), starts)


def _process_term(centre, width, columns, starts, problem: Problem) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The best of a few values of log10 q around `centre`, and a bracket that has halved."""
    if problem.kind != "turn" and not problem.floor_known:
        # White noise of unknown size: the scale is profiled out, and q would be the same thing again.
        return centre, jnp.zeros_like(width)
    points = jnp.clip(centre + width * jnp.linspace(-1, 1, PROCESS_POINTS, dtype=width.dtype), *PROCESS_RANGE)
    cost = jax.vmap(lambda q: negative_log_likelihood(q, columns, starts, problem))(points)
    best = jnp.argmin(cost)
    at_edge = ((best == 0) | (best == PROCESS_POINTS - 1)) & (points[best] > PROCESS_RANGE[0])
    return points[best], jnp.where(at_edge, width, jnp.maximum(width / 2, 0.02))


def _sum_by(
    values: Float[Array, "sequence row c"], index: Int[Array, "sequence row"], count: int
) -> Float[Array, "k c"]:
    flat = values.reshape(-1, values.shape[-1])
    return jax.ops.segment_sum(flat, index.reshape(-1), num_segments=count + 1)
