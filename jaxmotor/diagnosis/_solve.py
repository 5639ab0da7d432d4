"""Least squares for a motor with any effects, from its simulation alone.

Residuals are differenced over steps that each effect knows to be wide enough: laws with events (a contact, a stop, a
limit reached) have derivatives of single trajectories that miss the events' shift. One compiled program simulates all
columns of a Jacobian side by side, and is used again for every step, every start and every comparison.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float

from jaxmotor._balanced import balanced, solve_balanced
from jaxmotor._precision import to_jax, to_numpy
from jaxmotor.diagnosis._free import (
    Layout,
    free_of,
    is_possible,
    is_wide,
    layout_of,
    motor_at,
    motors_at,
    moved,
    numbers_at,
    together,
)
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._residuals import residuals_program
from jaxmotor.diagnosis._shared_program import Sharing, shared_leaves
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import AbstractDisturbance, AbstractLearnedEffect, Rig
from jaxmotor.motor.effects._substep import parts_of
from jaxmotor.prediction import (
    SPEED_STEP,
    as_begins,
    faster,
    first_speeds,
    fit_initial_places,
    in_motion,
    without_initial_speeds,
)

STEPS = 25
"""Of a fit at most."""
WIDE_STEPS, WIDE_TOLERANCE = 8, 2e-4
"""Of laws with events: their cost has local minima of that depth."""
SURE, HOPE = 2, 3.0
"""Steps after which a fit may be given up, and how many times what a step promises it may still hope for."""
CRAWLED = 3
"""Steps in a row that bring next to nothing of what they promise, after which a fit is left where it is."""
ASTRAY = 4
"""Steps in a row to motors that cannot be, after which it is, too."""
FEW = 3
"""Steps per row of which all are taken at once: to see that fewer do as well takes as long."""
ROUGH = 0.01
"""Part of chi2 that a step must promise where others explain far more."""
SHORT = 200_000
"""Steps in all rows of a log up to which motors share programs: in longer ones the neutral effects take, over the some
fifty times that a motor is simulated in its fit, as long as it takes to compile a program without them."""
SHORT_ALONE = 4_000
"""The same of a log that is one sequence, up to which they share more: there they take a third longer, which over all
fits of a diagnosis is a quarter of what compiling takes that is saved."""
WIDTH, BATCH = 8, 16
"""Motors that a program simulates side by side, at least, and in a short log in how many sequences in all: more are
several calls, of which as many run as there are cores. In a log of one sequence 16 motors take 1.1 to 1.4 times as long
as 8; a long one needs fewer at once, each with no more effects than its own."""
KEPT = 64
"""Programs that a solver looks up by itself; more are looked up among those of the process."""
HANGS = 3
"""Times that a motor is fitted anew after its load was placed within its gap."""
SHARES, SHORTER = 0.5 ** np.arange(8), np.geomspace(1e-3, 1e5, 8)
"""Of a step that goes too far; and dampings, relative to the balanced normal equations, of others in its place."""
DAMPINGS = 1e-9 + np.geomspace(1e-4, 1e6, 21)
"""That are tried at once where a step must be short."""
DAMPING = 1e-9
"""Of the balanced normal equations, for what the recording does not show."""


@dataclasses.dataclass(frozen=True, eq=False)
class Fitted:
    """A motor fitted to a trial's chosen rows, and the linearisation there. n rows, p free numbers."""

    template: Motor
    free: Float[np.ndarray, " p"]
    speeds: Float[np.ndarray, " k"]
    """How pieces begin: at which speed [rad/s], which counts where it is free; with a gap (2k,) at which place in that,
    too."""
    residual: Float[np.ndarray, " n"]
    """Drift of the rows [standard deviations of the encoder's own]."""
    jacobian: Float[np.ndarray, "n p"]
    """Of `residual`, initial speeds projected out."""
    converged: bool
    """The last step promised less than `tolerance`."""
    variance: float = 1.0
    """Of residuals that the priors were weighed against."""
    ties: Float[np.ndarray, "r p"] | None = None
    """`Layout.ties`"""
    steps: int | None = None
    """Per row, in which the motor was simulated; None: as many as its trial says (`Solver.most`)."""

    @property
    def chi2(self) -> float:
        """Mean square of `residual`: 1 is the encoder alone."""
        return square_of(self.residual) / max(len(self.residual), 1)

    @functools.cached_property
    def motor(self) -> Motor:
        return motor_at(self.template, self.free)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(effect.name for effect in self.template.effects)

    @property
    def layout(self) -> Layout:
        return layout_of(self.template.effects, self.variance)._replace(ties=self.ties)


def is_short(trial: Trial, limit: int = SHORT) -> bool:
    """The rows of `trial` are no more than `limit` steps."""
    return int(trial.used) * int(trial.steps) * len(trial.valid) <= limit


class Solver:
    """Fits motors to the rows of one trial; `rows` (sequence, row) chooses which count.

    Priors are weighed against the variance that the residual has in sums over blocks, not against that of single rows:
    what a motor leaves unexplained is alike in many of them. With H = JᵀJ and g_b the sum of Jᵀr over block b it is
    Σ g_bᵀH⁻¹g_b/p, at least 1 (the magnitude adjustment of a composite likelihood [Pauli, Racugno, Ventura 2011]).
    """

    def __init__(
        self,
        trial: Trial,
        rows: np.ndarray | None = None,
        noise_known: bool = True,
        request: Request | None = None,
        rig: Rig | None = None,
    ):
        """With a `rig` fits end where they lead to effects that it cannot have."""
        self.trial, self.noise_known, self.request, self.rig = trial, noise_known, request or Request(), rig
        self.given = to_jax(trial)
        """The same as arrays of JAX: programs would copy numpy's each time."""
        self.cells = np.flatnonzero(trial.valid if rows is None else trial.valid & rows)
        batch = trial.problem.batch
        sequence, row = np.unravel_index(self.cells, trial.valid.shape)
        self.places = row * len(trial.valid) + sequence
        """The same where rows come first."""
        self.piece = np.asarray(batch.piece).reshape(-1)[self.cells]
        self.block = np.unique(np.asarray(batch.cluster).reshape(-1)[self.cells], return_inverse=True)[1]
        """(n,) number of the block of each row: only blocks are taken to be independent."""
        self.pieces = trial.problem.pieces + 1
        self.moves = in_motion(trial)
        """(k,) which pieces begin in motion."""
        self.free_pieces = bool(self.moves.any())
        self.scale = 1 / math.sqrt(trial.variance)
        self.is_short = is_short(trial)
        alone = len(trial.valid) == 1 and is_short(trial, SHORT_ALONE)
        self.sharing: Sharing = "most" if alone else "simple" if self.is_short else "nothing"
        self.window_s = float(trial.problem.window) if trial.problem.kind == "window" else None
        """Over which speeds are means, where they are [s]; one that is sought is the motor's."""
        self.starts = first_speeds(trial)
        """Where the initial speeds of free pieces are sought from (k,) [rad/s]."""
        self.most = int(trial.steps)
        """Steps per row, in which a motor is simulated where nothing else is asked for."""
        self._in_steps: dict[int, _Given] = {}
        self._called: dict[tuple[Any, tuple[int, ...]], Callable[[list[Any]], dict[str, Any]]] = {}
        """Programs by the structure of their motors and the shape of how these begin."""
        self.width = max(WIDTH, BATCH // len(trial.valid)) if self.is_short else WIDTH
        """Motors that a program simulates side by side."""

    def residuals(self, motors: Motor, speeds: np.ndarray, steps: int | None = None) -> np.ndarray:
        """(k, n) filtered residuals of motors whose leaves are (k,), simulated in `steps` per row (None: `most`)."""
        speeds = as_begins(speeds, len(self.starts), motors)
        shared, tree = shared_leaves(motors, self.sharing, self.window_s)
        leaves = [*shared, speeds]

        def part(begin: int) -> np.ndarray:
            some = [leaf[begin : begin + self.width] for leaf in leaves]
            return self.rows(self._program(some, tree, steps)["drift"])[: len(some[-1])]

        begins = range(0, len(speeds), self.width)
        # What a long log takes in memory is not taken twice.
        return np.concatenate(side_by_side(part, begins) if self.is_short else [part(begin) for begin in begins])

    def residual_of(self, motor: Motor, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(sequence, row) unfiltered residuals [units], zero where nothing was measured, and (n,) filtered ones."""
        speeds = as_begins(speeds, len(self.starts), motor)
        leaves, tree = shared_leaves(together([motor]), self.sharing, self.window_s)
        found = self._program([*leaves, speeds[None]], tree)
        return np.asarray(found["plain"])[..., 0].T, self.rows(found["drift"])[0]

    def rows(self, drift: Any) -> np.ndarray:
        """(k, n) of `drift` (row, sequence, k), the rows that count [standard deviations]."""
        each = np.asarray(drift)
        with np.errstate(over="ignore"):
            return np.take(each.reshape(-1, each.shape[-1]), self.places, axis=0).T * self.scale

    def _program(self, leaves: list[np.ndarray], tree: Any, steps: int | None = None) -> dict[str, Any]:
        """Of motors of the structure `tree` and of initial speeds, whose `leaves` have at most `width` rows, the last
        of which is repeated."""
        rows = np.minimum(np.arange(self.width), len(leaves[-1]) - 1)
        leaves, given = [leaf[rows] for leaf in leaves], self._given_in(self.most if steps is None else steps)
        called = self._called.get((tree, leaves[-1].shape))
        if called is None:
            found = residuals_program.ready(jax.tree.unflatten(tree, leaves[:-1]), leaves[-1], given.trial)
            assert found is not None
            called, _ = found
            if len(self._called) == KEPT:
                self._called.clear()
            self._called[tree, leaves[-1].shape] = called
        return called([*leaves, *given.arrays])

    def _given_in(self, steps: int) -> "_Given":
        """The trial, whose rows are simulated in `steps`."""
        if steps not in self._in_steps:
            trial = eqx.tree_at(lambda trial: trial.steps, self.given, to_jax(np.int32(steps)))
            self._in_steps[steps] = _Given(trial, jax.tree.leaves(eqx.filter(trial, eqx.is_array)))
        return self._in_steps[steps]

    def linearise(
        self, template: Motor, free: np.ndarray, speeds: np.ndarray, steps: int | None = None
    ) -> tuple[np.ndarray, np.ndarray, Any]:
        """Residual (n,), Jacobian (n, p) and the column (n,) of the initial speeds, if any is free."""
        layout = layout_of(template.effects)
        moves = np.diag(layout.difference)
        both = is_wide(template.effects)
        begins = [free[None], free + moves, *([free - moves] if both else [])]
        frees = np.concatenate([*begins, free[None]] if self.free_pieces else begins)
        starts = np.repeat(speeds[None], len(frees), axis=0)
        if self.free_pieces:
            starts[-1] = faster(starts[-1], SPEED_STEP * self.moves)
        found = self.residuals(motors_at(template, frees), starts, steps)
        p = len(free)
        # Wild motors overflow; a step that leads to one is not taken.
        with np.errstate(over="ignore", invalid="ignore"):
            if both:
                jacobian = (found[1 : p + 1] - found[p + 1 : 2 * p + 1]) / (2 * layout.difference[:, None])
            else:
                jacobian = (found[1 : p + 1] - found[0]) / layout.difference[:, None]
            column = (found[-1] - found[0]) / SPEED_STEP if self.free_pieces else None
        return np.where(np.isfinite(found[0]), found[0], np.nan), jacobian.T, column

    def fit(
        self,
        motor: Motor,
        near: Fitted | None = None,
        tolerance: float = 1e-4,
        steps: int = STEPS,
        bar: float = math.inf,
        far: float = math.inf,
        ties: Float[np.ndarray, "r p"] | None = None,
    ) -> Fitted:
        """From `motor`, and how pieces begin in the fit `near` to it, until a step promises less than `tolerance` of
        chi2 (of 1, where that is less), or `steps`; less than `ROUGH` of it while it is above `far`.

        Given up before where it will hardly come below a chi2 of `bar`, or from `far` above that of others near to
        them: by what its steps promise, or as they went on. Also where its steps keep little of what they promise, and
        where they lead astray.

        Rows are simulated in as few steps as they need, from those on that they needed `near` (`_first_steps`): in
        twice as many while that changes the residual by more than `tolerance` allows (of chi2, or of 1 where that is
        less), or `ROUGH` where the fit is given up.
        """
        self.request.trying(tuple(effect.name for effect in motor.effects))
        speeds = as_begins(self._begins(near), len(self.starts), motor)
        goal = _Goal(tolerance, steps, bar, far, ties)
        motor = to_numpy(motor)
        at = self._at(motor, free_of(motor), speeds, self._first_steps(motor, near))
        while True:
            at, ended = self._descended(motor, at, goal)
            if parts_of(motor.effects).has_gap and ended != "given up":
                at = self._hung(motor, at, goal)
            if at.steps >= self.most or parts_of(motor.effects).exact:
                break
            finer = self._at(motor, at.free, at.speeds, min(2 * at.steps, self.most))
            allowed = ROUGH if ended == "given up" else tolerance
            same = square_of(finer.residual - at.residual) <= allowed * max(square_of(at.residual), len(at.residual))
            at = finer
            if same:
                break
        return Fitted(
            motor,
            at.free,
            at.speeds,
            at.residual,
            at.jacobian,
            ended == "converged",
            block_variance(at.projected, at.jacobian, self.block),
            ties,
            at.steps,
        )

    def _descended(self, motor: Motor, at: "_At", goal: "_Goal") -> "tuple[_At, Ended]":
        """From `at` to the end of a fit."""
        tolerance, steps = goal.tolerance, goal.steps
        if is_wide(motor.effects):
            tolerance, steps = max(tolerance, WIDE_TOLERANCE), min(steps, WIDE_STEPS)
        crawled, astray, gain, count = 0, 0, math.inf, len(at.residual)
        for number in range(steps):
            # What is left, and with it the weight of priors, changes as a fit goes on.
            variance = block_variance(at.projected, at.jacobian, self.block)
            layout = layout_of(motor.effects, variance)._replace(ties=goal.ties)
            step = self._step(at, layout)
            if step is None:
                return at, "stopped"
            square = square_of(at.residual)
            least = (max(tolerance, ROUGH) if square > goal.far * count else tolerance) * max(square, count)
            if step.promise < least:
                return at, "converged"
            before = self._cost(at, layout)
            going_on = (steps - number) * gain
            if number >= SURE and goal.is_out_of_reach(before / count, step.hope / count, going_on / count):
                return at, "given up"
            new = self._moved(motor, at, step, layout)
            if new is None:
                return at, "stopped"
            at, gain = new, before - self._cost(new, layout)
            if gain < 0.001 * before and step.promise < 10 * least:
                return at, "converged"
            crawled = crawled + 1 if gain < min(0.1 * step.promise, 0.01 * before) else 0
            astray = 0 if self._is_possible(motor, at.free) else astray + 1
            if crawled == CRAWLED or astray == ASTRAY:
                return at, "given up"
        return at, "stopped"

    def _hung(self, motor: Motor, at: "_At", goal: "_Goal") -> "_At":
        """`at` with its load where in its gap it fits best as pieces begin, and fitted again as long as that helps."""
        for _ in range(HANGS):
            begins = self.placed(numbers_at(motor, at.free), at.speeds, at.steps)
            new = self._at(motor, at.free, begins, at.steps)
            new = self._descended(motor, new, goal)[0]
            if not square_of(new.residual) < (1 - WIDE_TOLERANCE) * square_of(at.residual):
                break
            at = new
        return at

    def placed(self, motor: Motor, speeds: np.ndarray, steps: int | None = None) -> np.ndarray:
        """`speeds` with the place of a load within its gap that fits each piece best."""
        speeds = as_begins(speeds, len(self.starts), motor)

        def residuals(begins: np.ndarray) -> np.ndarray:
            return self.residuals(together([motor] * len(begins)), begins, steps)

        return speeds if len(speeds) == len(self.starts) else fit_initial_places(residuals, speeds, self.piece)

    def linearised(self, fitted: Fitted, free: np.ndarray, speeds: np.ndarray) -> Fitted:
        """`fitted` at other free numbers (p,), where pieces begin at `speeds`."""
        steps = self.most if fitted.steps is None else fitted.steps
        at = self._at(fitted.template, free, speeds, steps)
        return dataclasses.replace(fitted, free=free, speeds=speeds, residual=at.residual, jacobian=at.jacobian)

    def _begins(self, near: Fitted | None) -> np.ndarray:
        """Those of `near`, if that is of as many pieces."""
        pieces = len(self.starts)
        return self.starts if near is None or len(near.speeds) not in (pieces, 2 * pieces) else near.speeds

    def _first_steps(self, motor: Motor, near: Fitted | None) -> int:
        """Per row, in which a fit begins: with the effects of `near`, and curves and disturbances beside them, fewer
        than there would only lead away from it. With other laws they lead out of local minima."""
        least = self.most if self.most <= FEW else 1
        if near is None or not {effect.name for effect in motor.effects}.issuperset(near.names):
            return least
        more = [effect for effect in motor.effects if effect.name not in near.names]
        if not all(isinstance(effect, AbstractLearnedEffect | AbstractDisturbance) for effect in more):
            return least
        return max(least, min(near.steps or self.most, self.most))

    def _is_possible(self, motor: Motor, free: np.ndarray) -> bool:
        return self.rig is None or is_possible(numbers_at(motor, free), self.rig)

    def _at(self, motor: Motor, free: np.ndarray, speeds: np.ndarray, steps: int, *, shortened: bool = False) -> "_At":
        residual, jacobian, column = self.linearise(motor, free, speeds, steps)
        columns, shift = np.column_stack([residual, jacobian]), None
        if column is not None:
            columns, shift = without_initial_speeds(columns, column, self.piece, self.pieces)
        return _At(free, speeds, residual, columns[:, 0], columns[:, 1:], shift, steps, shortened)

    def _step(self, at: "_At", layout: Layout) -> "_Step | None":
        residual, jacobian = at.projected, at.jacobian
        weight = 1 / layout.spread
        if not (np.isfinite(at.free).all() and np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return None
        pull = (at.free - layout.prior) * weight
        normal = np.einsum("np,nq->pq", jacobian, jacobian) + np.diag(weight**2)
        right = -(np.einsum("np,n->p", jacobian, residual) + weight * pull)
        if layout.ties is not None:
            normal += layout.ties.T @ layout.ties
            right -= layout.ties.T @ (layout.ties @ at.free)
        if not np.isfinite(normal).all() or not np.isfinite(right).all():
            return None
        low, high = layout.low - at.free, layout.high - at.free
        # What has a prior is held back by that, and by its bounds.
        longest = np.where(np.isfinite(layout.spread), np.inf, layout.longest)
        whole = _boxed(normal, right, low, high)
        step = whole
        if (np.abs(whole) > longest).any():
            low, high = np.maximum(low, -longest), np.minimum(high, longest)
            tried = [_boxed(normal, right, low, high), _damped(normal, right, low, high)]
            step = max(tried, key=lambda one: _gain(normal, right, one))
        initial = square_of(at.residual) - square_of(residual)
        damped = np.clip(solve_balanced(normal, right, SHORTER[:, None, None]), low, high)
        return _Step(step, damped, at.shift, *(_gain(normal, right, one) + initial for one in (step, whole)))

    def _moved(self, motor: Motor, at: "_At", step: "_Step", layout: Layout) -> "_At | None":
        """`at` after the step, or after the best of the shorter ones; None where none of them helps."""
        before = self._cost(at, layout)
        ones, speeds = zip(*step.shorter(), strict=True)
        frees, starts = moved(motor, at.free, np.stack(ones)), np.stack([faster(at.speeds, one) for one in speeds])
        if not at.shortened:
            whole = self._at(motor, frees[0], starts[0], at.steps)
            if self._cost(whole, layout) < before:
                return whole
        found = self.residuals(motors_at(motor, frees), starts, at.steps)
        costs = np.array(
            [square_of(residual) + _prior(free, layout) for residual, free in zip(found, frees, strict=True)]
        )
        best = int(np.nanargmin(np.where(np.isfinite(costs), costs, np.inf)))
        if not costs[best] < before:
            return None
        return self._at(motor, frees[best], starts[best], at.steps, shortened=best > 0)

    def _cost(self, at: "_At", layout: Layout) -> float:
        return square_of(at.residual) + _prior(at.free, layout)


Ended = Literal["converged", "stopped", "given up"]


class _Given(NamedTuple):
    """A trial in JAX's arrays, and these by themselves, as its programs take them."""

    trial: Trial
    arrays: list[Any]


class _Goal(NamedTuple):
    """Where a fit ends (`Solver.fit`)."""

    tolerance: float
    steps: int
    """Of the fit, at most; not those of a row."""
    bar: float
    far: float
    ties: Float[np.ndarray, "r p"] | None

    def is_out_of_reach(self, chi2: float, hope: float, going_on: float) -> bool:
        """A fit at `chi2` will not come to the goal if it may hope for so much, and for that as it went on."""
        return chi2 - min(HOPE * hope, going_on) > self.bar or chi2 - going_on > self.far


@dataclasses.dataclass(frozen=True, eq=False)
class _At:
    free: np.ndarray
    speeds: np.ndarray
    residual: np.ndarray
    projected: np.ndarray
    """The residual, and `jacobian` likewise, without what initial speeds explain."""
    jacobian: np.ndarray
    shift: np.ndarray | None
    """(pieces, 1 + p) by how much initial speeds would have to move for the residual and for each free number."""
    steps: int
    """Per row."""
    shortened: bool
    """The step that led here had to be: the next one may have to be, too."""


@dataclasses.dataclass(frozen=True, eq=False)
class _Step:
    free: np.ndarray
    damped: np.ndarray
    """(k, p) steps in its place where it goes too far."""
    shift: np.ndarray | None
    """(pieces, 1 + p) by how much initial speeds would have to move for the residual and for each free number."""
    promise: float
    """By how much the linearisation lowers the cost."""
    hope: float
    """The same if a step might go as far as it likes."""

    def shorter(self) -> Iterator[tuple[np.ndarray, np.ndarray | float]]:
        """The step, parts of it, and steps that are damped more and more (Levenberg-Marquardt)."""
        for share in SHARES:
            yield share * self.free, share * self.speeds(self.free)
        for step in self.damped:
            yield step, self.speeds(step)

    def speeds(self, step: np.ndarray) -> np.ndarray | float:
        """(k,) by how much initial speeds move with a `step` of the free numbers [rad/s]."""
        return 0.0 if self.shift is None else -self.shift[:, 0] - self.shift[:, 1:] @ step


def block_variance(residual: np.ndarray, jacobian: np.ndarray, block: np.ndarray) -> float:
    """Of `residual` (n,), at least 1, as its sums over blocks `block` (n,) have it in the directions of `jacobian`
    (n, p); 1 where a motor diverges."""
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        return 1.0
    normal = np.einsum("np,nq->pq", jacobian, jacobian)
    pulls = np.stack([np.bincount(block, column * residual) for column in jacobian.T], axis=1)
    return max(float(np.einsum("bp,bp->", pulls, solve_balanced(normal, pulls, DAMPING))) / len(normal), 1.0)


def _boxed(normal: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The step from `low` to `high` that solves the normal equations: what goes beyond is held there, one after the
    other, the furthest first, and the rest goes with it."""
    ones, scale = balanced(normal, DAMPING)
    step, held = np.zeros(len(right)), np.zeros(len(right), bool)
    while not held.all():
        free = np.flatnonzero(~held)
        rows = ones[free]
        wanted = right[free] / scale[free] - rows[:, held] @ (step * scale)[held]
        step[free] = np.linalg.solve(rows[:, free], wanted) / scale[free]
        beyond = np.where(~held, np.maximum(low - step, step - high) * scale, -np.inf)
        worst = int(np.argmax(beyond))
        if beyond[worst] <= 0:
            break
        held[worst] = True
        step[worst] = np.clip(step[worst], low[worst], high[worst])
    return step


def _damped(normal: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The step whose damping is just enough that it stays between `low` and `high` (Marquardt): where elements only
    help together, none of them may be held alone."""
    steps = solve_balanced(normal, right, DAMPINGS[:, None, None])
    inside = ((low <= steps) & (steps <= high)).all(axis=1)
    return np.clip(steps[int(np.argmax(inside)) if inside.any() else -1], low, high)


def _gain(normal: np.ndarray, right: np.ndarray, step: np.ndarray) -> float:
    """By how much the linearisation lowers the cost."""
    return float(2 * right @ step - step @ normal @ step)


def square_of(residual: np.ndarray) -> float:
    """Sum of squares, infinite where it is none."""
    # Not a product of vectors: BLAS starts threads for it, which on a busy machine wait for each other.
    square = float(np.einsum("n,n->", residual, residual))
    return square if math.isfinite(square) else math.inf


def _prior(free: np.ndarray, layout: Layout) -> float:
    tied = 0.0 if layout.ties is None else square_of(layout.ties @ free)
    return float((((free - layout.prior) / layout.spread) ** 2).sum()) + tied
