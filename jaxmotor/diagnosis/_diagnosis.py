"""What a diagnosis gives: a verdict, what is left, and how the linear model does on data that it did not fit."""

import dataclasses
import math
from typing import Any, Literal

from jaxmotor.diagnosis._looks import Look
from jaxmotor.diagnosis._missing import MissingVolts
from jaxmotor.estimate import Fit
from jaxmotor.validation import Score

FORMAT = 1
Verdict = Literal["complete", "unexplained"]


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where the linear model of one recording fails, and what that looks like."""

    fit: Fit
    """The linear motor, fitted to all segments but those held out."""
    whole: Fit
    """The linear motor, fitted to all segments."""
    held_out: Score
    """Of `fit`, on the segments held out."""
    verdict: Verdict
    """`complete`: nothing is left over; `unexplained`: see `looks_like`."""
    missing: MissingVolts
    """The voltage that the linear model lacks, window by window."""
    looks: tuple[Look, ...]
    """What the missing volts depend on, the most telling first."""
    notes: tuple[str, ...]

    @property
    def looks_like(self) -> Look | None:
        """The most telling look, where the verdict is `unexplained`."""
        return None if self.verdict == "complete" else self.looks[0] if self.looks else None

    def __repr__(self) -> str:
        look = "" if self.looks_like is None else f": {self.looks_like.text}"
        return f"Diagnosis({self.verdict}{look}, chi2 {self.held_out.chi2_per_sample:.3g} held out)"


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """`diagnosis` as an object of plain numbers and strings. No effect is named yet, so `effects` is empty."""
    linear = {"gain_rad_s_V": float(diagnosis.fit.motor.gain), "pole_rad_s": float(diagnosis.fit.motor.pole)}
    whole, look = diagnosis.whole, diagnosis.looks_like
    held_out = (diagnosis.held_out.chi2_per_sample, diagnosis.held_out.fit_percent)
    return {
        "format": FORMAT,
        "recording": whole.source.rpartition("/")[2],
        "verdict": diagnosis.verdict,
        "linear": linear,
        "model": linear,
        "effects": [],
        "held_out": _unchanged(*held_out),
        "whole": _unchanged(whole.chi2_per_sample, whole.fit_percent),
        "looks_like": None if look is None else {"coordinate": look.coordinate, "text": look.text},
        "missing_volts": {"rms_V": _number(diagnosis.missing.rms_V), "noise_V": _number(diagnosis.missing.noise_V)},
        "looks": [
            {"coordinate": look.coordinate, "text": look.text, "share": look.share, "chance": look.chance}
            for look in diagnosis.looks
        ],
        "held_out_segments": list(diagnosis.fit.held_out),
        "notes": list(diagnosis.notes),
    }


def _unchanged(chi2: float, fit: float) -> dict[str, float]:
    """Before and after are the same until effects extend the model."""
    return {"chi2_before": chi2, "chi2_after": chi2, "fit_percent_before": fit, "fit_percent_after": fit}


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
