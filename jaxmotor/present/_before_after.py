"""One held-out segment, and one closed loop, before and after the model was extended."""

import math

import numpy as np
from matplotlib.figure import Figure

from jaxmotor.diagnosis import Diagnosis, LoopGain
from jaxmotor.estimate import Trace, fit_percent
from jaxmotor.present._fit import with_gaps
from jaxmotor.present._style import EXACT, GREY, PAPER, SMALL_DOTS, OnAxes, legend_above, panels, styled

MOST_ROWS = 500
LINEAR, EXTENDED = (style | {"linewidth": 1.0} for style in (PAPER, EXACT))


@styled
def before_after(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Measured speed and both motors in free simulation, in the held-out segment that gained most; below, the
    residuals. Shows at most 500 rows, those in which the gain is largest, and no extended motor where there is none."""
    before, after = best_gain(diagnosis)
    rows = most_gained(before, after, MOST_ROWS)
    time, gap = with_gaps(before.time_s[rows])
    figure, axes = panels(2, 3.2, heights=(3, 2), axes=axes)
    speed, left = axes[:, 0]
    speed.plot(before.time_s[rows], before.measured_rad_s[rows], label="measured", **SMALL_DOTS)
    motors = ((before, LINEAR, "linear"), (after, EXTENDED, "extended"))
    for trace, style, name in motors if diagnosis.named else motors[:1]:
        speed.plot(time, gap(trace.simulated_rad_s[rows]), label=f"{name}, fit {fit_percent((trace,)):.1f} %", **style)
        left.plot(time, gap(trace.residual_rad_s[rows]), label=name, **style)
    left.axhline(0, color=GREY, linewidth=0.6, zorder=0.5)
    speed.set_ylabel("Speed (rad/s)")
    left.set(xlabel="Time in the segment (s)", ylabel="Residual\n(rad/s)")
    for ax in (speed, left):
        ax.margins(x=0.01)
    legend_above(speed, columns=3)
    return figure


@styled
def loop_before_after(gain: LoopGain, *, axes: OnAxes = None) -> Figure:
    """Measured speed in a closed loop, and that of the linear and of the extended motor, where there is one, under the
    same controller."""
    loop = gain.before
    figure, axes = panels(1, 2.3, axes=axes)
    ax = axes[0, 0]
    ax.plot(loop.time_s, loop.measured_speed_rad_s, label="measured", **SMALL_DOTS)
    motors = ((gain.before, LINEAR, "linear"), (gain.after, EXTENDED, "extended"))
    for run, style, name in motors if gain.after is not gain.before else motors[:1]:
        ax.plot(loop.time_s, run.speed.mean, label=name, **style)
    ax.set(xlabel="Time in the segment (s)", ylabel="Speed (rad/s)")
    ax.margins(x=0.01)
    legend_above(ax, columns=3)
    return figure


def best_gain(diagnosis: Diagnosis) -> tuple[Trace, Trace]:
    """The traces, linear and extended, of the held-out segment whose squared error fell most, in proportion; of the
    fitted ones where none was held out. Only segments in which the speed changes, if there are any."""
    scores = diagnosis.held_out if diagnosis.held_out.traces_before else diagnosis.whole
    pairs = list(zip(scores.traces_before, scores.traces_after, strict=True))
    turning = [pair for pair in pairs if math.isfinite(fit_percent(pair[:1]))] or pairs
    return max(turning, key=lambda pair: squared_error_fall(*pair))


def squared_error_fall(before: Trace, after: Trace) -> float:
    """Part [1] of the linear motor's squared error that the extended one does not have."""
    error = float(np.sum(before.residual_rad_s**2))
    return float(np.sum(_gain(before, after))) / error if error > 0 else 0.0


def _gain(before: Trace, after: Trace) -> np.ndarray:
    return before.residual_rad_s**2 - after.residual_rad_s**2


def most_gained(before: Trace, after: Trace, most: int) -> slice:
    """At most `most` rows, those in which the squared error fell most."""
    size = len(before.time_s)
    if size <= most:
        return slice(0, size)
    total = np.concatenate([[0.0], np.cumsum(_gain(before, after))])
    begin = int(np.argmax(total[most:] - total[:-most]))
    return slice(begin, begin + most)
