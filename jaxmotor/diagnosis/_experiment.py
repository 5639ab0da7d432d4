"""Which further experiment would tell two explanations apart.

Both motors were fitted to the same recording and say the same about it. They are simulated under experiments that were
perhaps not in it; the one under which their angles part most, beside what the encoder rounds, is the one to record.
"""

import dataclasses
from collections.abc import Iterable

import equinox as eqx
import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor import Motor
from jaxmotor.recording import Recording

TELLS = 0.05
"""Excess of chi2 per sample of an experiment that is worth recording."""


@dataclasses.dataclass(frozen=True)
class Experiment:
    """What to record next."""

    text: str
    separates: tuple[str, str]
    """Names of the two effects."""
    chi2_excess: float
    """By how much, per sample, the experiment would be fitted worse by the second."""
    plan: str | None
    """As a plan file; None where no experiment of this rig tells them apart."""


@dataclasses.dataclass(frozen=True)
class _Candidate:
    text: str
    toml: str
    volts: np.ndarray


def experiment(
    solver: Solver, names: tuple[str, str], first: Motor, second: Fitted, recording: Recording
) -> Experiment:
    """The experiment that tells motor `first`, with effect `names[0]`, from `second`, with `names[1]`, best."""
    period_s = float(np.asarray(solver.trial.measured_log.duration))
    candidates = _candidates(solver.trial, period_s, float(first.linear.pole))
    excess = [
        one
        for some in _in_parts(candidates, solver.trial.time.shape[0])
        for one in _excesses(_on(solver.trial, some, first, period_s), len(some), first, second)
    ]
    best = int(np.argmax(excess))
    if not excess[best] > TELLS:
        seconds = solver.trial.time.shape[1] * period_s
        text = f"no ramp or sine of {seconds:.2g} s tells {names[0]} from {names[1]}; a longer one or another rig may"
        return Experiment(text, names, float(excess[best]), None)
    chosen = candidates[best]
    plan = "\n".join([f'name = "tell {names[0]} from {names[1]}"', *_rig(recording, period_s), chosen.toml])
    text = f"{chosen.text} tells {names[0]} from {names[1]}"
    return Experiment(text, names, float(excess[best]), plan)


def joined(experiments: Iterable[Experiment]) -> tuple[Experiment, ...]:
    """`experiments`, of which those that are the same become one that says all that it tells."""
    found: dict[object, Experiment] = {}
    for one in experiments:
        # The first line of a plan is its name.
        same = one.text if one.plan is None else one.plan.partition("\n")[2]
        known = found.get(same)
        told = f"{one.separates[0]} from {one.separates[1]}"
        found[same] = one if known is None else dataclasses.replace(known, text=f"{known.text}, and {told}")
    return tuple(found.values())


def _rig(recording: Recording, period_s: float) -> list[str]:
    """The head of a plan for the rig of `recording`, at the nearest period that the board has."""
    lines = [f"period_ms = {min(max(round(1e3 * period_s), 1), 20)}"]
    if recording.drive is not None:
        lines.append(f'drive = "{recording.drive}"')
    if recording.supply_V is not None:
        lines.append(f"supply_V = {recording.supply_V:g}")
    if recording.counts_per_rev is not None:
        lines.append(f"counts_per_rev = {recording.counts_per_rev:.10g}")
    return [*lines, "", "[[experiment]]"]


def _in_parts(candidates: list[_Candidate], most: int) -> list[list[_Candidate]]:
    """`most` at a time: as many as a trial has sequences."""
    return [candidates[begin : begin + most] for begin in range(0, len(candidates), most)]


def _excesses(trial: Trial, number: int, first: Motor, second: Fitted) -> list[float]:
    """Of each experiment in the first `number` sequences of `trial`."""
    other, rows = Solver(trial), trial.time.shape[1]
    _, wanted = other.residual_of(first, np.zeros(other.pieces))
    shown, jacobian, _ = other.linearise(second.template, second.free, np.zeros(other.pieces))
    sequences = [slice(k * rows, (k + 1) * rows) for k in range(number)]
    return [_excess((shown - wanted)[sequence], jacobian[sequence], second) for sequence in sequences]


def _excess(apart: np.ndarray, jacobian: np.ndarray, second: Fitted) -> float:
    """Mean square of `apart` once `second` has moved as far as the recording lets it to make up for it."""
    held = second.jacobian.T @ second.jacobian
    right = jacobian.T @ apart
    return float((apart @ apart - right @ solve_balanced(jacobian.T @ jacobian + held, right, 1e-9)) / len(apart))


def _candidates(trial: Trial, period: float, pole: float) -> list[_Candidate]:
    """As long as a sequence of the trial is, so that nothing new is compiled."""
    ticks = trial.time.shape[1]
    supply, seconds = float(trial.supply), ticks * period
    time = np.arange(ticks) * period
    found: list[_Candidate] = []

    def add(text: str, kind: str, volts: np.ndarray, **keys: float) -> None:
        lines = [f'kind = "{kind}"', *(f"{name} = {value:.4g}" for name, value in keys.items())]
        found.append(_Candidate(text, "\n".join([*lines, f"duration_s = {seconds:.3g}", ""]), volts))

    for share in (0.9, 0.5, 0.2, 0.08):
        high = share * supply
        add(f"a slow ramp to {high:.2g} V", "ramp", high * time / time[-1], from_V=0.0, to_V=high)
        for frequency in (0.3, 0.3 * pole, min(1.5 * pole / 2, 0.15 / period)):
            sine = high * np.sin(2 * np.pi * frequency * time)
            text = f"a sine of {frequency:.2g} Hz and {high:.2g} V"
            add(text, "sine", sine, frequency_Hz=frequency, amplitude_V=high)
    return found


def _on(trial: Trial, candidates: list[_Candidate], motor: Motor, period: float) -> Trial:
    """`trial` with one candidate in each sequence, from rest, instead of what was recorded."""
    shape = trial.time.shape
    volts = np.zeros(shape)
    volts[: len(candidates)] = [candidate.volts for candidate in candidates]
    reset = np.zeros(shape, bool)
    reset[:, 0] = True
    batch = trial.problem.batch._replace(
        volts=volts,
        reset=reset,
        free=np.zeros(shape),
        observed=np.zeros(shape),
        valid=np.ones(shape, bool),
        duration=np.broadcast_to(
            np.asarray(trial.problem.batch.duration) * 0 + period, trial.problem.batch.duration.shape
        ),
    )
    time = np.broadcast_to(np.arange(shape[1]) * period, shape)
    problem = eqx.tree_at(lambda problem: problem.batch, trial.problem, batch)
    new = eqx.tree_at(lambda trial: (trial.problem, trial.time), trial, (problem, time))
    if trial.angle is None:
        return new
    return eqx.tree_at(lambda trial: trial.angle, new, _turned(motor, volts, period))


def _turned(motor: Motor, volts: np.ndarray, period: float) -> np.ndarray:
    """About where the shaft is [rad]."""
    gain, keep = float(motor.linear.gain), np.exp(-float(motor.linear.pole) * period)
    speed = np.zeros(volts.shape)
    speed[:, 1:] = gain * (1 - keep) * volts[:, :-1]
    # Of w[k] = keep w[k-1] + v[k] each pass adds what twice as many rows before have left.
    rows, most = 1, volts.shape[-1]
    while rows < most:
        speed[:, rows:] += keep**rows * speed[:, :-rows]
        rows *= 2
    return np.cumsum(speed, axis=1) * period
