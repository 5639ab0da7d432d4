"""How far the estimates may be off: from the encoder, from disturbances, and from what the model leaves out.

Four answers, because no single one holds for all recordings (F = EᵀE with E the whitened Jacobian, e the whitened
residual):

`model`       F⁻¹, times the residual's variance where that exceeds one. Right for white errors.
`clustered`   From how the estimate moves when one segment is left out (the jackknife, "CR3"): F_s and score g_s of each
              segment give (F - F_s)⁻¹ g_s, or F⁻¹ g_s where it has all but a tenth of the information on some
              parameter. Right for errors that are alike within a segment, whatever they are, at the price of few
              degrees of freedom: 1/Σ share² - 1, where share is a segment's part of the information. Up to two, a
              segment or two tell nearly all: the others do not say how far off that is.
`requantised` From rounding the fitted motion anew with random encoder offsets. The rounding error is not white where
              the motor stands still, hardly moves, or repeats the same counts every period; chi2 does not show that.
`allowance`   How far the estimate moves when Coulomb friction and a delay, the two things that real motors have and a
              linear model lacks, are let into the fit (one linear step), if the data ask for them.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from jaxmotor.estimate._trajectory import Linearised, Solution, solve_normal, whitened
from jaxmotor.motor import SecondOrder
from jaxmotor.prediction import LAG_S, Problem, motor_of, observe, reading_of

REDRAWS = 150
"""Random encoder offsets drawn for `requantised`."""
HIDDEN = ("friction", "delay", "dead zone", "drag", "electrical lag")
"""What may hide behind gain, pole and offset: Coulomb friction [V], a delay [ticks], a dead zone [V], drag with the
square of the speed [V at the highest speed], and the electrical time constant [s]. The first two are what `allowance`
is of."""
SMALLEST_REST = 1e-12
"""Part of its square that is left of a column for certain: below it there are rounding errors."""
MOST = 0.9
"""Part of the information on a parameter, from which the one segment that has it is not left out of it: the rest would
only say that it is lost."""
LEAST_REST = 1e-3
"""Part of a missing effect's square that gain, pole and offset must leave over for it to be fitted."""


class Uncertainty(NamedTuple):
    """Covariances of ψ (see `_trajectory`) and what they rest on."""

    model: Float[Array, "p p"]
    clustered: Float[Array, "p p"]
    degrees_of_freedom: Float[Array, " p"]
    """Of `clustered`, for each parameter."""
    clusters: Float[Array, ""]
    """Number of blocks of rows that `clustered` rests on."""
    requantised: Float[Array, "p p"]
    """The same as `model` where the encoder's resolution is not known."""
    allowance: Float[Array, " p"]
    """By how much ψ moves when friction and delay are let in."""
    evidence: Float[Array, ""]
    """By how much they lower the sum of squared whitened residuals, 2 by chance; where rounding errors that repeat
    themselves alone lower it by more than 2, in proportion."""
    log10_q: Float[Array, ""]
    chi2: Float[Array, ""]
    """Mean squared residual of the plain differences over the floor."""
    pole_share: Float[Array, ""]
    """Part of the motion (root mean square about its mean) that a pole e times as large would change, with gain and
    offset at their best [1]."""
    hidden: Float[Array, " h"]
    """Amount of each of `HIDDEN`, alone beside the motor, that fits best."""
    hidden_error: Float[Array, " h"]
    """Its standard error, were the whitened residual white."""
    hidden_shift: Float[Array, "p h"]
    """By how much ψ moves for one unit of it."""
    hidden_score: Float[Array, "k h"]
    """What ψ leaves of each law's column, times the whitened residual, summed over each block of rows."""
    hidden_information: Float[Array, "k h h"]
    """The same of two laws' columns."""
    hidden_square: Float[Array, ""]
    """Sum of the squares of the whitened residual."""


def uncertainty(problem: Problem, solution: Solution, at: Linearised, key: Key[Array, ""]) -> Uncertainty:
    """All four, from the linearisation `at` the end of `solution`; nothing is fitted again."""
    size = solution.psi.shape[0]
    extra = _hidden(solution, at, problem)
    columns = jnp.concatenate([solution.residual[..., None], solution.jacobian, extra], axis=-1)
    white, _, _ = whitened(columns, at.starts, 10**solution.log10_q, problem)
    error, jacobian, hidden = jnp.split(white, (1, 1 + size), axis=-1)
    error = error[..., 0]
    extra = hidden[..., :2]
    count = jnp.asarray(problem.batch.valid).sum().astype(error.dtype)
    normal = jnp.einsum("lrp,lrq->pq", jacobian, jacobian)
    inverse = solve_normal(normal, jnp.eye(size, dtype=normal.dtype))
    variance = (error**2).sum() / (count - size)
    if problem.floor_known:
        variance = jnp.maximum(variance, 1.0)
    clustered, freedom, clusters = _clustered(error, jacobian, normal, inverse, problem)
    requantised = inverse * variance
    chi2 = (solution.residual**2).sum() / count / problem.floor
    open_to, hidden_error = _open(error, jacobian, hidden, normal, problem)
    held, own = _against(jacobian, extra, normal)
    amount, evidence = _amount(extra, error, own)
    evidence = evidence / variance
    if problem.floor_known:
        requantised, by_rounding = _requantised(jacobian, extra, inverse, held, own, solution, at, problem, chi2, key)
        repeats = jnp.maximum(by_rounding / extra.shape[-1], 1.0)
        evidence, hidden_error = evidence / repeats, hidden_error * jnp.sqrt(repeats)
    return Uncertainty(
        model=inverse * variance,
        clustered=clustered,
        degrees_of_freedom=freedom,
        clusters=clusters,
        requantised=requantised,
        allowance=-held @ amount,
        evidence=evidence,
        log10_q=solution.log10_q,
        chi2=chi2,
        pole_share=_pole_share(solution, problem),
        hidden_error=hidden_error * jnp.sqrt(variance),
        hidden_square=(error**2).sum(),
        **open_to,
    )


def _pole_share(solution: Solution, problem: Problem) -> Float[Array, ""]:
    linear, pole = solution.jacobian[..., :2], solution.jacobian[..., 2]
    normal = jnp.einsum("lrp,lrq->pq", linear, linear)
    rest = pole - linear @ solve_normal(normal, jnp.einsum("lrp,lr->p", linear, pole))
    observed, valid = jnp.asarray(problem.batch.observed), jnp.asarray(problem.batch.valid)
    about = observed - observed.mean(where=valid)
    return jnp.sqrt((rest**2).sum() / (about**2).sum(where=valid))


def _hidden(solution: Solution, at: Linearised, problem: Problem) -> Float[Array, "sequence row h"]:
    """What one unit of each of `HIDDEN` adds to the prediction [units]: its derivative along a voltage, or L/R."""
    gain, batch = solution.psi[0], problem.batch
    motor, reading = motor_of(solution.psi.at[0].set(1.0), problem), reading_of(solution.psi, problem)
    volts, reset = jnp.asarray(batch.volts), jnp.asarray(batch.reset)
    start = jnp.asarray(batch.free) * solution.initial_speed[batch.piece]

    def seen(volts: Float[Array, "sequence row"], lag: Float[Array, ""]) -> Float[Array, "sequence row"]:
        return observe(SecondOrder(motor.gain, motor.pole, lag), problem, volts, start, reading)

    def along(lag: Float[Array, ""], drive: Float[Array, "sequence row"], lagging: Float[Array, ""]) -> Array:
        return jax.jvp(seen, (gain * volts + solution.psi[1], lag), (gain * drive, lagging))[1]

    each = jnp.stack(drives(volts, reset, jnp.sign(gain) * at.prediction))
    if isinstance(motor, SecondOrder):
        # One simulation, compiled once, tells of all.
        lagging = jnp.zeros(len(HIDDEN), gain.dtype).at[-1].set(1.0)
        each = jnp.concatenate([each, jnp.zeros_like(each[:1])])
        found = jax.vmap(functools.partial(along, motor.electrical_time_constant), out_axes=-1)(each, lagging)
    else:
        rest = jnp.zeros_like(start)
        found = jax.vmap(lambda drive: observe(motor, problem, gain * drive, rest, reading), out_axes=-1)(each)
        if problem.kind == "window":
            lagging = along(jnp.full_like(gain, LAG_S[0]), jnp.zeros_like(volts), jnp.ones_like(gain))
        else:  # without a simulation of second order, whose compilation takes a tenth of a cold identification
            by_pole = solution.jacobian[..., 2]
            lagging = lagging_of(motor.pole, gain * volts + solution.psi[1], at.prediction + by_pole, problem)
        found = jnp.concatenate([found, lagging[..., None]], axis=-1)
    return jnp.where(jnp.asarray(batch.valid)[..., None], found, 0.0)


def lagging_of(
    pole: Float[Array, ""], drive: Float[Array, "sequence row"], both: Float[Array, "sequence row"], problem: Problem
) -> Float[Array, "sequence row"]:
    """What the first of L/R adds to the prediction of a motor of first order [units for each second of it].

    Of K/(1 + s/a + s² τ/a) the derivative by τ is, at none, -s a ∂/∂a of K/(1 + s/a). With w' = a (v - w), v the steady
    speed under a row's voltage (`drive` [rad/s]), that is a (w + ∂w/∂log a - v), v of the row before. Of the turn θ
    over a row of duration h it is the integral of that, a (θ + ∂θ/∂log a - v h). `both` is the sum of the prediction
    and its derivative by log a.
    """
    batch = problem.batch
    if problem.kind == "turn":
        return pole * (both - drive * jnp.asarray(batch.duration) / problem.unit)
    before = jnp.pad(drive[:, :-1], ((0, 0), (1, 0))) / problem.unit
    return jnp.where(jnp.asarray(batch.reset), 0.0, pole * (both - before))


def drives(
    volts: Float[Array, "sequence row"], reset: Bool[Array, "sequence row"], turning: Float[Array, "sequence row"]
) -> tuple[Float[Array, "sequence row"], ...]:
    """The voltage that one unit of each of `HIDDEN` but the last adds, of a motor that turns by `turning` [units], the
    way positive voltages turn it taken to be positive."""
    # A turn of less than a quarter count says nothing about the direction.
    turning = jnp.where(jnp.abs(turning) > 0.25, turning, 0.0)
    before = jnp.where(reset, 0.0, jnp.pad(volts[:, :-1], ((0, 0), (1, 0))))
    drag = -turning * jnp.abs(turning) / jnp.maximum((turning**2).max(), 1e-30)
    return -jnp.sign(turning), before - volts, -jnp.sign(volts), drag


def _open(error, jacobian, hidden, normal, problem: Problem) -> tuple[dict[str, Array], Float[Array, " h"]]:
    """The fields of `Uncertainty` about `HIDDEN`, and the errors of the amounts if those of the whitened rows are of
    size one. Where gain, pole and offset can do all that one of them does, the error of its amount is huge."""
    across = jnp.einsum("lrp,lrh->ph", jacobian, hidden)
    held = solve_normal(normal, across)
    whole = jnp.einsum("lrh,lrh->h", hidden, hidden)
    rest = hidden - jnp.einsum("lrp,ph->lrh", jacobian, held)
    own = jnp.maximum(jnp.einsum("lrh,lrh->h", rest, rest), SMALLEST_REST * whole)
    own = jnp.where(own > 0, own, 1.0)
    amount = jnp.einsum("lrh,lr->h", rest, error) / own
    score, information = _by_cluster(rest * error[..., None], problem), _products(rest, problem)
    fields = {"hidden": amount, "hidden_shift": -held, "hidden_score": score, "hidden_information": information}
    return fields, 1 / jnp.sqrt(own)


def _by_cluster(values: Float[Array, "sequence row c"], problem: Problem) -> Float[Array, "k c"]:
    """Sums over each block of rows."""
    flat, cluster = values.reshape(-1, values.shape[-1]), jnp.asarray(problem.batch.cluster).reshape(-1)
    return jax.ops.segment_sum(flat, cluster, num_segments=problem.clusters + 1)[:-1]


def _products(columns: Float[Array, "sequence row c"], problem: Problem) -> Float[Array, "k c c"]:
    """The same of each two columns' product."""
    size = columns.shape[-1]
    products = columns[..., :, None] * columns[..., None, :]
    return _by_cluster(products.reshape(*columns.shape[:-1], size * size), problem).reshape(-1, size, size)


def _clustered(error, jacobian, normal, inverse, problem: Problem):
    """Jackknife covariance, degrees of freedom, number of clusters."""
    score, information = _by_cluster(jacobian * error[..., None], problem), _products(jacobian, problem)
    used = (jnp.trace(information, axis1=1, axis2=2) > 0).astype(error.dtype)
    # A parameter's information with the others at their best: what its row of the inverse picks out of each segment.
    share = jnp.einsum("pi,sij,pj->sp", inverse, information, inverse) / jnp.diag(inverse)[None, :]
    # Without one that tells most of some parameter the others would be lost with that.
    rest = normal[None] - jnp.where((share > MOST).any(1)[:, None, None], 0.0, information)
    moved = jax.vmap(lambda rest, score: -solve_normal(rest, score))(rest, score)
    moved = jnp.where(used[:, None] > 0, moved, 0.0)
    number = used.sum()
    away = (moved - moved.sum(0, keepdims=True) / number) * used[:, None]
    return (number - 1) / number * away.T @ away, 1 / (share**2).sum(0) - 1, number


def _requantised(jacobian, extra, inverse, held, own, solution: Solution, at: Linearised, problem: Problem, chi2, key):
    """Covariance of F⁻¹ Eᵀ e over rounding errors e of the fitted motion drawn with random encoder offsets, and the
    mean evidence for `extra` that such errors give."""
    size = jacobian.shape[-1]
    position = jnp.cumsum(at.prediction, axis=1) - at.prediction
    after, piece = position + at.prediction, jnp.asarray(problem.batch.piece)

    def whitened_errors(errors):
        return whitened(errors[..., None], at.starts, 10**solution.log10_q, problem)[0][..., 0]

    # Whitening is linear: its transpose, taken once for each column, saves whitening every draw.
    _, transpose = jax.vjp(whitened_errors, position)
    weights = jax.vmap(lambda column: transpose(column)[0], in_axes=-1)(jnp.concatenate([jacobian, extra], axis=-1))
    weights = jnp.where(jnp.asarray(problem.batch.valid)[None], weights, 0.0)

    def draw(key):
        offset = jax.random.uniform(key, (problem.pieces + 1,), position.dtype)[piece]
        errors = (jnp.floor(after + offset) - after) - (jnp.floor(position + offset) - position)
        score = jnp.einsum("clr,lr->c", weights, errors)
        amount = score[size:] - held.T @ score[:size]
        return inverse @ score[:size], jnp.where(jnp.diag(own) > 0, amount, 0.0) @ solve_normal(own, amount)

    moved, evidence = jax.lax.map(draw, jax.random.split(key, REDRAWS))
    return moved.T @ moved / REDRAWS * jnp.maximum(chi2, 1.0), evidence.mean()


def _against(jacobian, extra, normal) -> tuple[Float[Array, "p e"], Float[Array, "e e"]]:
    """What of `extra` the parameters can do, and the information on the rest.

    A column that the parameters can do almost wholly (friction in one direction is an offset) has no rest: it
    would be fitted with any amount.
    """
    across = jnp.einsum("lrp,lre->pe", jacobian, extra)
    held = solve_normal(normal, across)
    whole = jnp.einsum("lre,lrf->ef", extra, extra)
    own = whole - across.T @ held
    kept = jnp.diag(own) > LEAST_REST * jnp.diag(whole)
    return held, jnp.where(jnp.outer(kept, kept), own, 0.0)


def _amount(extra, error, own) -> tuple[Float[Array, " e"], Float[Array, ""]]:
    """Best amounts of `extra` for the residual `error`, and the drop of its sum of squares."""
    score = jnp.einsum("lre,lr->e", extra, error)
    amount = jnp.where(jnp.diag(own) > 0, solve_normal(own, score), 0.0)
    return amount, score @ amount
