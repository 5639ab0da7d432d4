"""From a recording to what its linear model gets wrong."""

from jaxmotor._precision import in_float64
from jaxmotor.diagnosis._diagnosis import Diagnosis, Verdict
from jaxmotor.diagnosis._looks import Look, looks
from jaxmotor.diagnosis._missing import MissingVolts, missing_volts
from jaxmotor.diagnosis._split import split
from jaxmotor.estimate import Fit, identify, model_of
from jaxmotor.recording import Recording
from jaxmotor.validation import Score, score_open_loop

FLOOR = 1.1
"""chi2 per sample up to which the encoder's rounding, which is not quite white, explains the residuals."""
TELLING = 0.25
"""Share of the missing volts that one coordinate explains in a motor whose linear model is not complete."""


def diagnose(recording: Recording, *, seed: int = 0) -> Diagnosis:
    """Fit the linear motor to two thirds of `recording`, and say what is left over and what it depends on.

    `seed` draws the shuffles that tell a dependence from chance, and encoder offsets.

    **Raises:** `JaxmotorError`, one sentence, where the recording does not determine a linear motor.
    """
    whole = identify(recording, seed=seed)
    parts, held_out = split(recording)
    fit = identify(parts, hold_out=held_out, seed=seed) if held_out else whole
    score = _held_out(fit, parts, held_out)
    missing = missing_volts(whole, recording)
    found = looks(missing, seed)
    return Diagnosis(
        fit=fit,
        whole=whole,
        held_out=score,
        verdict=_verdict(whole, score, missing, found),
        missing=missing,
        looks=found,
        notes=whole.notes if held_out else (*whole.notes, "the recording is too short to hold a part of it out"),
    )


@in_float64
def _held_out(fit: Fit, recording: Recording, held_out: tuple[int, ...]) -> Score:
    return score_open_loop(model_of(fit), recording, held_out or fit.fitted).pooled


def _verdict(whole: Fit, score: Score, missing: MissingVolts, found: tuple[Look, ...]) -> Verdict:
    """Complete where chi2 is at the floor and no coordinate explains a telling part of more than noise."""
    if max(whole.chi2_per_sample, score.chi2_per_sample) > FLOOR:
        return "unexplained" if found else "complete"
    loud = missing.rms_V > 1.25 * missing.noise_V
    return "unexplained" if loud and found and found[0].beyond_chance and found[0].share > TELLING else "complete"
