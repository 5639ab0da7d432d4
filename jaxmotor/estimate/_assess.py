"""Which standard errors to state, and whether the recording determines the motor at all."""

import dataclasses

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._numbers import with_error
from jaxmotor.estimate._hidden import ENDLESS, hidden_laws, student_t
from jaxmotor.estimate._open_hypotheses import (
    UNITS,
    Allowed,
    OpenHypothesis,
    largest_voltage,
    open_hypotheses,
    shown_laws,
)
from jaxmotor.estimate._speed_average import SpeedAverage, properties_of
from jaxmotor.estimate._timing import Timing
from jaxmotor.estimate._trajectory import Solution
from jaxmotor.estimate._uncertainty import HIDDEN, Uncertainty
from jaxmotor.motor import AbstractLinearMotor, linear_motor
from jaxmotor.prediction import LAG_S, Packed
from jaxmotor.recording import Recording, warn_early, warn_fixed_time, warn_spikes, warn_stopped

WINDOW = (
    "an average of the speeds{}may hide it: state that (jaxmotor import: --speed-window, 0 for none), or add steps, or "
    "fast sines"
)
SLOW = "it shows in how the speed follows a fast change: add steps, or sines near the pole's frequency"
JUMP, MANY_JUMPS = 0.2, 20
"""Part of the range of the voltages by which a step changes them at least; steps to which some more add little."""
QUIET_LOG10_Q = -4.0
"""Below this process term [decades of the floor] the encoder alone explains the residuals."""
QUIET_CHI2 = 1.1
"""chi2 per sample up to which the residual may be the noise alone."""
CHANCE = 10.0
"""Drop of the sum of squares that chance gives at most where friction and delay are let in."""
EVIDENCE = 40.0
"""The same by which they are taken to be there: a rounding error that repeats itself or a torque that wanders gives up
to 30, coloured noise as many times that as its rows are one."""
FEW_CLUSTERS = 6
"""With fewer blocks of rows than this their disagreement says too little on its own."""
UNDETERMINED = 0.3
"""Relative standard error from which a parameter is said not to be determined."""
HELD_OFFSET = (1,)
"""The place of the voltage offset in ψ."""
NO_OFFSET = (
    "this input does not tell a constant voltage error (offset) from the gain: it is taken to be none; to decide, add "
    "steps of a second height"
)
UNLIKE = "it does not explain this recording"
BEYOND = (
    "the voltage offset is larger than any voltage that was applied: if something else than the logged 0 is no "
    "voltage, state that (jaxmotor import: --input COL:duty:FULL@ZERO), or a load drives the motor"
)
LEAST_POLE_SHARE = 0.01
"""A pole that shows in less than this part of the motion would be fitted to the model error."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Assessment:
    """What is stated of an estimate."""

    motor: AbstractLinearMotor
    standard_error: AbstractLinearMotor
    """One for each parameter, in its unit; 1.96 of them each way hold the truth 95 times of 100."""
    covariance: np.ndarray
    """(p, p) of (gain [rad/s/V], pole [rad/s], electrical time constant [s] if there is one)."""
    offset_V: float
    """Constant voltage error that was fitted along [V]; 0 where the method has none."""
    offset_standard_error_V: float
    timing: Timing | None = None
    """The log's own, where the header does not state it and the data show one."""
    average: SpeedAverage | None = None
    """The same of its speeds."""
    notes: tuple[str, ...]
    """Sentences that a user should read."""
    open_hypotheses: tuple[OpenHypothesis, ...] = ()
    """Laws that the recording can neither show nor exclude."""
    allowed: Allowed | None = None
    """Intervals of gain and pole that allow for hidden laws; None where the method does not know."""


def is_quiet(packed: Packed, errors: Uncertainty) -> bool:
    """The encoder alone explains the residuals."""
    return bool(packed.observation.floor_known and errors.log10_q < QUIET_LOG10_Q and errors.chi2 < QUIET_CHI2)


def assess(
    recording: Recording,
    packed: Packed,
    solution: Solution,
    errors: Uncertainty,
    of_log: tuple[str, ...] = (),
    alike: bool = False,
    held: tuple[int, ...] = (),
) -> Assessment:
    """The standard errors that fit the residuals' nature, and notes on what they rest on.

    Where the encoder alone explains the residuals: rounding drawn anew. Else: from how segments disagree, widened
    by Student's t, so that 1.96 standard errors hold the truth 95 times of 100; where one or two tell nearly all, from
    the residual's size and colour if that is more than how they disagree. What friction or a delay would move is added
    where the recording shows them. ψ ends with what is `of_log`: "filter" (log of its time constant [s]), "window" (log
    of its rows) and "offset" (rows); `alike` says that an offset would do as well as the window. Of ψ those that are
    `held` were not fitted.

    **Raises:** `JaxmotorError` where gain or pole are not determined.
    """
    psi, errors, notes = np.asarray(solution.psi), _of_fitted(errors, held), [NO_OFFSET] if held else []
    model, covariance, shift = np.asarray(errors.model), _by_residuals(packed, errors), _left_over(packed, errors)
    if shift is not None:
        covariance = covariance + np.outer(shift, shift)
        notes.append(
            "the motor does more than a linear one (friction or a delay, if only a little, show in the data): the "
            "standard errors account for this model error"
        )
    if of_log:
        lag = LAG_S[1] * np.asarray(errors.hidden_shift)[:, HIDDEN.index("electrical lag")]
        covariance = covariance + np.outer(lag, lag)
    fitted = np.isin(np.arange(len(psi)), held, invert=True)
    covariance = np.where(np.outer(fitted, fitted), covariance, 0.0)
    timing, average = properties_of(psi, covariance, of_log, packed.durations[0], alike)
    log_s = len(packed) * packed.durations[0]
    # Of what is not determined nothing is said.
    timing = timing if timing is not None and timing.standard_error_s < log_s else None
    average = average if average is not None and average.lateness_error_s < log_s else None
    own = slice(len(psi) - len(of_log))
    psi, covariance, model = psi[own], covariance[own, own], model[own, own]
    # K, b, log a, log tau -> K, a, tau [, and u0 = b/K].
    scale = np.concatenate([[1.0], np.exp(psi[2:])])
    kept = np.delete(np.delete(covariance, 1, 0), 1, 1) * np.outer(scale, scale)
    offset = psi[1] / psi[0]
    slope = np.zeros(len(psi))
    slope[:2] = -offset / psi[0], 1 / psi[0]
    _determined(recording, psi, model, float(errors.pole_share), average)
    _signed(recording, float(psi[0]), float(np.sqrt(kept[0, 0])))
    notes += _wide(psi, kept, float(errors.chi2), _jumps(packed))
    of_header = [one.sentence for one in (average, timing) if one is not None]
    motor, half = np.array([psi[0], np.exp(psi[2])]), 1.96 * np.sqrt(np.diag(kept)[:2])
    beside = hidden_laws(solution, errors, _by_chance(packed, errors), colour(packed), is_quiet(packed, errors))
    notes += shown_laws(packed, motor, beside)
    offset_error_V = float(np.sqrt(slope @ covariance @ slope))
    notes += [BEYOND] if abs(offset) - 1.96 * offset_error_V > largest_voltage(packed) else []
    left_open, allowed = open_hypotheses(packed, motor, half, beside)
    return Assessment(
        motor=linear_motor([psi[0], *np.exp(psi[2:])]),
        standard_error=linear_motor(np.sqrt(np.diag(kept))),
        covariance=kept,
        offset_V=float(offset),
        offset_standard_error_V=offset_error_V,
        timing=timing,
        average=average,
        notes=(*notes, *of_header, *(one.note for one in left_open)),
        open_hypotheses=left_open,
        allowed=allowed,
    )


def _of_fitted(errors: Uncertainty, held: tuple[int, ...]) -> Uncertainty:
    """`errors` in which those of ψ that were `held` are of size one and stand alone."""
    if not held:
        return errors
    squares, places = {}, list(held)
    for name in ("model", "clustered", "requantised"):
        square = np.array(getattr(errors, name))
        square[places] = square[:, places] = 0.0
        square[places, places] = 1.0
        squares[name] = square
    freedom = np.array(errors.degrees_of_freedom)
    freedom[places] = freedom.max(where=np.isfinite(freedom), initial=1.0)
    return errors._replace(degrees_of_freedom=freedom, **squares)


def _by_residuals(packed: Packed, errors: Uncertainty) -> np.ndarray:
    """The covariance of ψ that fits the residuals' nature."""
    if is_quiet(packed, errors):
        return np.asarray(errors.requantised)
    freedom, model = np.asarray(errors.degrees_of_freedom), np.asarray(errors.model)
    few_blocks = freedom <= ENDLESS
    widen = np.array([student_t(float(one)) / 1.96 for one in freedom])
    widen = np.where(few_blocks, 1.0, widen)
    covariance = np.asarray(errors.clustered) * np.outer(widen, widen)
    if errors.clusters < FEW_CLUSTERS:
        covariance = _larger(covariance, model)
    # What is left beside the noise is alike over a block.
    alike = colour(packed) + max(float(errors.chi2) - 1, 0.0) * len(packed) / float(errors.clusters)
    return _in_place(covariance, alike * model, few_blocks & (alike * np.diag(model) > np.diag(covariance)))


def _in_place(one: np.ndarray, other: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The covariance `one`; where any of its variances is to be that of `other`, at `places`, correlations are, too.
    It stays where `other` has a variance of none."""
    if not places.any() or not np.diag(other).min() > 0:
        return one
    scale = np.sqrt(np.where(places, 1.0, np.diag(one) / np.diag(other)))
    return other * np.outer(scale, scale)


def colour(packed: Packed) -> float:
    """Rows that are worth one independent reading, where the noise is not known."""
    noise = packed.observation.noise
    return 1.0 if noise.known else max(noise.rows_per_reading, 1.0)


def leaves_something(errors: Uncertainty) -> bool:
    """The motor may leave something beside white noise."""
    return max(float(errors.evidence), _strongest(errors)[0]) > CHANCE


def explained(packed: Packed, errors: Uncertainty) -> bool:
    """No friction and no delay are left to be seen."""
    return float(errors.evidence) <= _by_chance(packed, errors)


def _by_chance(packed: Packed, errors: Uncertainty) -> float:
    """Evidence that there may be without a cause: where no more than the noise is left, its colour looks like some."""
    return EVIDENCE * (colour(packed) if errors.chi2 < QUIET_CHI2 else 1.0)


def _left_over(packed: Packed, errors: Uncertainty) -> np.ndarray | None:
    """(p,) how far what the motor leaves beside the noise, friction or a delay or the one hidden law that explains
    most of it, moves ψ; None where the data show none."""
    by_chance = least = _by_chance(packed, errors)
    if np.min(errors.degrees_of_freedom) <= ENDLESS:
        # Blocks do not show what the motor leaves, so less evidence counts.
        least = min(by_chance, CHANCE * colour(packed))
    if errors.evidence > least:
        return np.asarray(errors.allowance)
    alone, law = _strongest(errors)
    if alone <= by_chance:
        return None
    # Taken to first order, a law may stand for more volts than it can take.
    most = largest_voltage(packed) if UNITS[HIDDEN[law]].startswith("V") else np.inf
    return np.asarray(errors.hidden_shift)[:, law] * np.clip(np.asarray(errors.hidden)[law], -most, most)


def _strongest(errors: Uncertainty) -> tuple[float, int]:
    """Drop of the sum of squares by the one hidden law that explains most, and which of `HIDDEN` that is."""
    drop = (np.asarray(errors.hidden) / np.asarray(errors.hidden_error)) ** 2
    best = int(np.argmax(drop))
    return float(drop[best]), best


def _larger(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The covariance `one`, its variances raised to those of `other`; `other` where `one` has a variance of none."""
    if not np.diag(one).min() > 0:
        return other
    raised = np.sqrt(np.maximum(np.diag(other) / np.diag(one), 1.0))
    return one * np.outer(raised, raised)


def _determined(
    recording: Recording, psi: np.ndarray, covariance: np.ndarray, pole_share: float, average: SpeedAverage | None
) -> None:
    """Whether the recording would determine the motor if the model were right (`covariance` of ψ), which may have an
    `average` of the speeds."""
    # Of what nothing determines rounding may make a variance less than none.
    error = np.sqrt(np.where(np.diag(covariance) >= 0, np.diag(covariance), np.nan))
    gain = psi[0]
    if not np.isfinite(error).all() or error[0] > UNDETERMINED * abs(gain):
        follow = "it needs voltages that differ and a motor that follows them: record steps or sines"
        [what, *_] = [*_damage(recording), follow]
        raise JaxmotorError(f"{recording.name}: the gain is not determined by this recording; {what}")
    if error[2] > UNDETERMINED or pole_share < LEAST_POLE_SHARE:
        unknown = recording.measured == "speed" and recording.speed_window_s is None
        length = f" (over {1e3 * average.length_s:.3g} ms fits best) " if average is not None else " "
        slow = WINDOW.format(length) if unknown else SLOW
        [what, *_] = [*_damage(recording), *warn_early(recording), slow]
        raise JaxmotorError(
            f"{recording.name}: the pole is not determined by this recording (the gain is {gain:.4g} "
            f"± {1.96 * error[0]:.2g} rad/s/V); {what}"
        )


def _signed(recording: Recording, gain: float, error: float) -> None:
    """Whether a motor that is said to turn against the voltage does."""
    if gain < 0 and 1.96 * error > -gain:
        found = with_error(gain, error, "rad/s/V")
        [what, *_] = [*_damage(recording), "something else than the voltage moves it: record steps or sines"]
        raise JaxmotorError(
            f"{recording.name}: the gain is not determined by this recording: {found} leaves open which way the motor "
            f"turns; {what}"
        )


def _damage(recording: Recording) -> list[str]:
    """What is wrong with readings."""
    return [*warn_fixed_time(recording), *warn_spikes(recording), *warn_stopped(recording)]


def _jumps(packed: Packed) -> int:
    """How often the voltage changes at once by a good part of its range."""
    volts = packed.batch.volts
    within = packed.batch.piece[:, 1:] == packed.batch.piece[:, :-1]
    return int((within & (np.abs(np.diff(volts)) > JUMP * np.ptp(volts))).sum())


def _wide(psi: np.ndarray, covariance: np.ndarray, chi2: float, jumps: int) -> list[str]:
    """A note on each parameter that is known but badly, or not at all, of an input that has so many `jumps`."""
    values = [("gain", abs(psi[0])), ("pole", float(np.exp(psi[2])))]
    shares = [1.96 * np.sqrt(covariance[k, k]) / value for k, (_, value) in enumerate(values)]
    explains = chi2 <= QUIET_CHI2
    more = "more steps" if jumps < MANY_JUMPS else "a longer recording"
    whose, why = ("the", f"{more} would tell more") if explains else ("the linear motor's", UNLIKE)
    return [
        f"{whose} {name} is {'only known to' if share < 1 else 'not determined,'} ± {100 * share:.0f} %: {why}"
        for (name, _), share in zip(values, shares, strict=True)
        if share > 0.1
    ]
