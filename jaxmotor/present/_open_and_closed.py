"""Validations as figures: what `jaxmotor.validation` found, drawn."""

import numpy as np
from matplotlib.figure import Figure

from jaxmotor.present._style import OnAxes
from jaxmotor.present._validation import Compared, closed_loop, step
from jaxmotor.validation import Band, ClosedLoop, StepTrials


def step_trials(trials: StepTrials, *, axes: OnAxes = None) -> Figure:
    """The mean of the trials of one step with its band, beside the model (Fig. 10)."""
    number = trials.trials
    several = number > 1
    measured, predicted = trials.measured, trials.predicted
    return step(
        Compared(trials.time_s, measured.mean, predicted.mean, _band(measured), _band(predicted)),
        title=f"step of {trials.amplitude_V:.3g} V, held out",
        measured_label=f"mean of {number} trials" if several else "measured, one trial",
        band_label="95 % of the mean" if several else "95 %, encoder alone",
        axes=axes,
    )


def controller(loop: ClosedLoop, *, axes: OnAxes = None) -> Figure:
    """Speed and control effort of a closed loop, beside the model's (Fig. 12)."""
    gain = f"k = {loop.gain_V_s_rad:.3g} V s/rad"
    if loop.integral_gain_V_rad:
        gain += f", {loop.integral_gain_V_rad:.3g} V/rad"
    return closed_loop(
        Compared(loop.time_s, loop.measured_speed_rad_s, loop.speed.mean, None, _band(loop.speed)),
        Compared(loop.time_s, loop.measured_volts_V, loop.volts.mean, None, _band(loop.volts), held=True),
        reference_rad_s=loop.reference_rad_s,
        limit_V=loop.limit_V if np.isfinite(loop.limit_V) else None,
        title=f"{loop.kind} control, {gain}, segment {loop.segment}, held out",
        axes=axes,
    )


def _band(band: Band) -> tuple[np.ndarray, np.ndarray] | None:
    return (band.low, band.high) if np.isfinite(band.low).any() and np.isfinite(band.high).any() else None
