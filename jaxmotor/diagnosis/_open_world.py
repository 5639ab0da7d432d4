"""What no named effect explains, learned as a curve.

Over each coordinate z (speed, voltage, shaft angle, time) a spline f(z) is added to the voltage. What it changes is
linear in its coefficients through the motor's linear part, so that one linear least-squares problem holds them and
small changes of the motor's own parameters. How smooth f is, and how much of the residual it explains that a constant
voltage does not, is judged on experiments that its coefficients were not fitted to. What a gain can do is left to the
gain: over speed and voltage f has no slope.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor._precision import in_float64, to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.diagnosis._coordinates import Places, coordinates, held_rows, rows_of_experiments, speed, under
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._learned_law import LearnedCoordinate, LearnedLaw, resemblances
from jaxmotor.diagnosis._residuals import drift
from jaxmotor.diagnosis._smooth import Judged, grams_of, judged
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.diagnosis._spline import INTERVALS, Spline, spline_over, steps
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor import Motor
from jaxmotor.motor.effects._base import AbstractLoadEffect
from jaxmotor.prediction import predicted_readings, without_initial_speeds
from jaxmotor.recording import Recording

COLUMNS = 32
"""Responses of one call: 31 to voltages, and one to initial speeds."""
IN_TIME = 89
"""Intervals of a curve over time."""
POINTS = 241
"""Of a law's curve."""
SHORTEST = 300
"""Rows below which nothing is learned."""
ROUNDS = 3
"""In which the best law and the motor beside it are learned again, at most."""
SETTLED = 0.01
"""Parts of the longest step that the motor still takes."""
LIKE = 0.05
"""Share from which a curve is compared with known ones; below it is mostly noise."""


@in_float64
def learn(recording: Recording, solver: Solver, fitted: Fitted) -> tuple[LearnedLaw, ...]:
    """What `fitted`, which `solver` fitted to all of `recording`, lacks over each coordinate; the best law first.

    A law is scored on the segments that `split` holds out; one over time, which can only go on over what it has seen
    around, on every third short while. Only where a jump over time is, is sought in all of them. There are no laws
    where the recording has fewer than `SHORTEST` rows.
    """
    if len(solver.cells) < SHORTEST:
        return ()
    study = _Study(solver, fitted, held_rows(recording, solver))
    found = [study.learned(coordinate, places) for coordinate, places in coordinates(solver, fitted).items()]
    found = sorted(found, key=lambda one: -one.judged.share)
    if found and found[0].judged.share > LIKE:
        found[0] = study.refined(found[0])
    return tuple(_law(one, one.places.at[study.used]) for one in found)


@program
def responses_program(motor: Motor, volts: Float[Array, "batch lane row"], trial: Trial) -> Arrays:
    """`drift` (row, batch, lane) of what the linear `motor` shows under each of `volts`; the last begins at 1 rad/s."""
    last = jnp.arange(volts.shape[0], dtype=jnp.int32) == volts.shape[0] - 1

    def one(volts: Float[Array, "lane row"], begin: Float[Array, ""]) -> Float[Array, "row lane"]:
        speeds = jnp.broadcast_to(begin, (trial.problem.pieces + 1,))
        return jnp.where(trial.problem.lanes.valid.T, predicted_readings(motor, speeds, under(trial, volts)), 0.0)

    return {"drift": drift(jax.vmap(one, out_axes=1)(volts, last.astype(volts.dtype)), trial)}


@dataclasses.dataclass(frozen=True, eq=False)
class _Learned:
    coordinate: LearnedCoordinate
    places: Places
    spline: Spline
    judged: Judged


class _Study:
    """A fitted motor, and what its residual may depend on."""

    def __init__(self, solver: Solver, fitted: Fitted, held: np.ndarray):
        self.solver, self.fitted, self.held = solver, fitted, held
        self.trial, self.cells = solver.trial, solver.cells
        self.lanes = self.trial.problem.lanes
        self.used, self.unit = rows_of_experiments(self.trial), float(self.trial.problem.unit)
        self.block = np.asarray(self.lanes.cluster).reshape(-1)[self.cells]
        self.duration = np.broadcast_to(np.asarray(self.lanes.duration), self.used.shape)
        linear, pole = fitted.motor.linear, float(fitted.motor.linear.pole)
        for effect in fitted.motor.effects:
            pole /= 1 + (float(effect.load().ratio) if isinstance(effect, AbstractLoadEffect) else 0.0)
        self.motor = linear_of(float(linear.gain), pole, float(linear.electrical_time_constant))  # pyright: ignore

    def learned(self, coordinate: LearnedCoordinate, places: Places, spline: Spline | None = None) -> _Learned:
        spline = spline or self._spline(coordinate, places.at)
        response = self._without(*self.responses(places.columns(spline, self.used)))
        held, block = self._moments(places.at) if coordinate == "time" else (self.held, self.block)
        level = coordinate in ("speed", "voltage")
        found = judged(grams_of(response, self.fitted, held, block), spline, places.at[self.used], level, self.fitted)
        return _Learned(coordinate, places, spline, found)

    def _moments(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which rows are held out of a curve over time, and their blocks: short enough for it to go on over them."""
        at, low, high = time.reshape(-1)[self.cells], time[self.used].min(), time[self.used].max()
        block = np.floor((at - low) / max(high - low, 1e-12) * 2 * IN_TIME).astype(int)
        return block % 3 == 2, block

    def refined(self, learned: _Learned) -> _Learned:
        """Learned again about the motor that goes with the curve; its worth is what it was at first sight."""
        study, again = self, learned
        for _ in range(ROUNDS):
            study, places, spline = study._moved(again.judged.shift), again.places, again.spline
            if again.coordinate == "speed":
                volts = np.zeros(self.used.shape)
                volts[self.used] = places.columns(spline, self.used, again.judged.jumps) @ again.judged.weights
                places = speed(self.solver, study.fitted, volts)
                spline = self._spline("speed", places.at)
            again = study.learned(again.coordinate, places, spline)
            if np.abs(again.judged.shift / self.fitted.layout.longest).max() < SETTLED:
                break
        worth = dataclasses.replace(again.judged, gain=learned.judged.gain, share=learned.judged.share)
        return dataclasses.replace(again, judged=worth)

    def _moved(self, shift: np.ndarray) -> "_Study":
        fitted, layout = self.fitted, self.fitted.layout
        shift = np.clip(shift, -layout.longest, layout.longest)
        free = np.clip(fitted.free + shift, layout.low, layout.high)
        residual, jacobian, starts = self.solver.linearise(fitted.template, free, fitted.speeds)
        columns = np.column_stack([residual, jacobian])
        columns = columns if starts is None else self._without(columns, starts)
        moved = dataclasses.replace(fitted, free=free, residual=columns[:, 0], jacobian=columns[:, 1:])
        return _Study(self.solver, moved, self.held)

    def _spline(self, coordinate: LearnedCoordinate, at: np.ndarray) -> Spline:
        if coordinate == "angle":
            return Spline(np.linspace(0, 2 * np.pi, COLUMNS), turn=True)
        spline = spline_over(at[self.used], IN_TIME if coordinate == "time" else INTERVALS)
        if coordinate == "speed" and at[self.used].min() < 0 < at[self.used].max():
            blur = 0.1 * self.unit / (float(np.median(self.duration)) if self.trial.problem.kind == "turn" else 1.0)
            return dataclasses.replace(spline, jump=0.0, width=blur)
        return dataclasses.replace(spline, jump=self._jump(at)) if coordinate == "time" else spline

    def _jump(self, time: np.ndarray) -> float:
        """Where one sudden change over time explains most, beside an offset and a drift."""
        at = time[self.used]
        low, high = float(at.min()), float(at.max())
        best = low
        while high - low > 20 * float(np.median(self.duration)):
            where = np.linspace(low, high, COLUMNS - 1)[1:-1]
            line = np.column_stack([np.ones_like(at), (at - at.mean()) / max(np.ptp(at), 1e-12)])
            response = self._without(*self.responses(np.column_stack([line, steps(at, where)])))
            base, _ = np.linalg.qr(np.column_stack([response[:, :2], self.fitted.jacobian]))
            left = response[:, 2:] - base @ (base.T @ response[:, 2:])
            gain = (left.T @ self.fitted.residual) ** 2 / np.maximum((left**2).sum(0), 1e-9)
            best = float(where[np.argmax(gain)])
            step = where[1] - where[0]
            low, high = max(best - step, low), min(best + step, high)
        return best

    def responses(self, volts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, k) what each of `volts` (used, k) changes, and (n,) what initial speeds do [standard deviations]."""
        found = []
        for begin in range(0, volts.shape[1], COLUMNS - 1):
            chosen = volts[:, begin : begin + COLUMNS - 1].T
            columns = np.zeros((COLUMNS, *self.used.shape))
            columns[: len(chosen), self.used] = chosen
            drifts = self.solver.rows(responses_program(self.motor, to_jax(columns), self.trial)["drift"])
            found.append(drifts[[*range(len(chosen)), -1]].T)
        return np.concatenate([part[:, :-1] for part in found], axis=1), found[0][:, -1]

    def _without(self, columns: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """`columns` (n, k) without what initial speeds explain."""
        return without_initial_speeds(columns, starts, self.solver.piece, self.solver.pieces)[0]


def _law(learned: _Learned, used: np.ndarray) -> LearnedLaw:
    spline, found = learned.spline, learned.judged
    low, high = spline.knots[[0, -1]] if spline.turn else np.quantile(used, [0.002, 0.998])
    at = np.linspace(low, high, POINTS)
    columns = spline.columns(at, found.jumps)
    volts = columns @ found.weights
    error = np.sqrt(np.maximum(np.einsum("nk,kl,nl->n", columns, found.covariance, columns, optimize=True), 0.0))
    density = np.gradient(np.interp(at, np.sort(used), np.linspace(0, 1, len(used))))
    weight = np.maximum(density, 0.05 / POINTS)
    like = resemblances(learned.coordinate, at, volts, weight, spline.jump) if found.share > LIKE else ()
    jump = spline.jump if found.jumps else None
    return LearnedLaw(learned.coordinate, at, volts, error, found.share, found.gain, jump, like)
