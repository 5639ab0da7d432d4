"""The numbers and tables in docs/paper.md, by their names in benchmarks/paper_page.md."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from delay import FREQUENCIES_HZ

from jaxmotor.bench import resolution_table
from jaxmotor.diagnosis import Diagnosis
from jaxmotor.estimate import Fit
from jaxmotor.motor import FirstOrder
from jaxmotor.present._bode import in_order, model_response
from jaxmotor.present._sine import sine_curve
from jaxmotor.present._zoh import decibel, degrees, exact_sampling
from jaxmotor.validation import Comparison, Validation

if TYPE_CHECKING:
    from paper import Found

GAIN, POLE, FRICTION_V = 10.6, 40.0, 0.2
"""Of the emulated motor of the bundled recording `paper` [rad/s/V, rad/s, V]."""
LINEAR_GAIN, LINEAR_POLE = 10.6005, 40.017
"""Of the motor of `linear`."""
LAG_S = 524e-6 / 4.5
"""L/R of the paper's Table 2."""
RPM = 30 / np.pi
"""Of 1 rad/s."""
PERIOD_S, COUNTS, AMPLITUDE_V = 0.005, 617.4, 5.1
SINE_HZ = 5.0
"""Of Fig. 6 and 7."""
PERIODS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)


def values(found: "Found") -> dict[str, float | str]:
    """All of them."""
    poles = np.sort(np.abs(np.roots([LAG_S, 1, POLE])))
    curve = sine_curve(found.recording, found.sine, float(found.exact.motor.pole))
    given: dict[str, float | str] = {
        "ticks": sum(len(segment) for segment in found.recording.segments),
        "inductive": 2 * np.pi * 50 * LAG_S,
        "slow_pole": float(poles[0]),
        "fast_pole": float(poles[1]),
        "drift": float(np.rad2deg(curve.drift_rad_s)),
        "swing": float(np.rad2deg(curve.measured.mean())),
        "true_gain_rpm": GAIN * RPM,
        "pole_Hz": POLE / (2 * np.pi),
        "rpm_dB": 20 * np.log10(RPM),
        **_sine_amplitude(found),
        "encoder_table": _encoder_table(),
        "hold_table": _hold_table(),
        "sine_table": _sine_table(found),
        "exact_left": _left_at_the_end(found.exact),
    }
    given |= _fit("exact", found.exact, GAIN, POLE) | _fit("paper", found.paper, GAIN, POLE)
    given |= _named(found.named)
    given |= _fit("linear", found.without_friction, LINEAR_GAIN, LINEAR_POLE)
    given |= _fit("smooth", found.exactly_without_friction, LINEAR_GAIN, LINEAR_POLE)
    return given | _delay(found) | _open_loop(found) | _closed_loop(found)


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """In Markdown."""
    lines = ["| " + " | ".join(row) + " |" for row in (head, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]])


def _fit(name: str, fit: Fit, gain: float, pole: float) -> dict[str, float | str]:
    found: dict[str, float | str] = {}
    for key, truth in (("gain", gain), ("pole", pole)):
        value = float(getattr(fit.motor, key))
        found[f"{name}_{key}"] = value
        found[f"{name}_{key}_off"] = 100 * (value / truth - 1)
        found[f"{name}_{key}_half"] = 1.96 * float(getattr(fit.standard_error, key))
    return found | _in_rpm(name, found)


def _in_rpm(name: str, found: dict[str, float | str]) -> dict[str, float | str]:
    """The gain and its interval in the paper's unit [rpm/V]."""
    gain, half = float(found[f"{name}_gain"]), float(found[f"{name}_gain_half"])
    return {f"{name}_gain_rpm": gain * RPM, f"{name}_gain_rpm_half": half * RPM}


def _named(found: Diagnosis) -> dict[str, float | str]:
    """The motor with the effects that were named, which are two."""
    sizes = {each.name: each.parameters for each in found.effects}
    errors = {each.name: each.standard_error for each in found.effects}
    gain, pole = float(found.motor.linear.gain), float(found.motor.linear.pole)
    given: dict[str, float | str] = {
        "named_gain": gain,
        "named_gain_half": 1.96 * found.standard_error["gain_rad_s_V"],
        "named_gain_off": 100 * (gain / GAIN - 1),
        "named_pole": pole,
        "named_pole_half": 1.96 * found.standard_error["pole_rad_s"],
        "named_pole_off": 100 * (pole / POLE - 1),
        "friction": sizes["coulomb_friction"]["volts_V"],
        "friction_half": 1.96 * errors["coulomb_friction"]["volts_V"],
        "sag": 100 * sizes["supply_sag"]["ratio"],
        "sag_half": 196 * errors["supply_sag"]["ratio"],
    }
    return given | _in_rpm("named", given)


def _encoder_table() -> str:
    rows = [(f"{1e3 * row.period_s:g}", f"{row.resolution_rpm:.3g}") for row in resolution_table(COUNTS, PERIODS_S)]
    return table(("Ts [ms]", "error of one count [rpm]"), rows)


def _hold_table() -> str:
    frequency = np.array([5.0, 10.0, 20.0, 40.0])
    with jax.enable_x64(True):
        exact = exact_sampling(FirstOrder(jnp.asarray(GAIN), jnp.asarray(POLE)), frequency, PERIOD_S)
    columns = (
        frequency,
        20 * np.log10(np.sinc(frequency * PERIOD_S)),
        -180 * frequency * PERIOD_S,
        decibel(exact),
        degrees(exact),
    )
    rows = [(f"{f:g}", f"{a:.2f}", f"{b:.1f}", f"{c:.2f}", f"{d:.1f}") for f, a, b, c, d in zip(*columns, strict=True)]
    return table(("Hz", "hold [dB]", "hold [degrees]", "hold and difference [dB]", "[degrees]"), rows)


def _sine_table(found: "Found") -> str:
    read, ours = found.paper.frequency_response, found.exact.frequency_response
    assert read is not None and ours is not None
    columns = [np.asarray(read.frequency_Hz)]
    for response in (np.asarray(read.response), np.asarray(ours.response)):
        columns += [decibel(response), np.rad2deg(np.angle(response))]
    rows = []
    for frequency, *both in sorted(zip(*columns, strict=True)):
        amplitude = AMPLITUDE_V * 10 ** (both[0] / 20)
        rows.append((f"{frequency:.3f}", f"{amplitude:.2f}", *(f"{value:.2f}" for value in both)))
    head = ("Hz", "A [rad/s]", "paper: gain [dB]", "paper: phase", "exact: gain [dB]", "exact: phase")
    return table(head, rows)


def _sine_amplitude(found: "Found") -> dict[str, float | str]:
    """Of the sine of Fig. 7, as the table of the sines has it."""
    response = found.paper.frequency_response
    assert response is not None
    nearest = int(np.argmin(np.abs(np.asarray(response.frequency_Hz) - SINE_HZ)))
    amplitude = AMPLITUDE_V * float(np.abs(np.asarray(response.response)[nearest]))
    return {"sine_amplitude": amplitude, "sine_amplitude_rpm": amplitude * RPM}


def _left_at_the_end(fit: Fit) -> float:
    """Phase of the measured response over the model's, at the highest frequency [degrees]."""
    assert fit.frequency_response is not None
    with jax.enable_x64(True):
        measured = in_order(fit.frequency_response)
        model = model_response(measured, fit.motor, "exact", np.asarray(measured.frequency_Hz))
        return float(np.rad2deg(np.angle(np.asarray(measured.response) / model))[-1])


def _delay(found: "Found") -> dict[str, float | str]:
    parts = found.parts[FRICTION_V]
    others = parts.electrical + parts.timer + parts.duty + parts.start
    columns = (parts.seen, parts.difference, parts.friction, others, parts.together)
    rows = [
        (f"{frequency:g}", *(f"{column[k]:+.2f}" for column in columns)) for k, frequency in enumerate(FREQUENCIES_HZ)
    ]
    return {
        "delay_table": table(("Hz", "seen", "count difference", "friction", "all others", "sum"), rows),
        "worst": max(float(np.abs(each.seen - each.together).max()) for each in found.parts.values()),
        "seen_0": float(found.parts[0.0].seen[-1]),
        "seen_2": float(parts.seen[-1]),
        "lead_2": float(parts.friction[-1]),
        "lead_5": float(found.parts[0.5].friction[-1]),
    }


COMPARED = ("", "measured", "with friction and sag [95 %]", "exact linear model [95 %]", "paper's model")


def _row(says: str, compared: Iterable[Comparison], unit: float = 1.0) -> tuple[str, ...]:
    named, exact, paper = compared
    banded = [
        f"{unit * each.value:.2f} [{unit * each.low:.2f}, {unit * each.high:.2f}]"
        for each in (named.predicted, exact.predicted)
    ]
    return says, f"{unit * exact.measured.value:.2f}", *banded, f"{unit * paper.predicted.value:.2f}"


def _open_loop(found: "Found") -> dict[str, float | str]:
    steps = [each.steps[0] for each in (found.extended, found.exactly, found.as_published)]
    named, ours, theirs = steps
    rows = [
        _row("rise time, 10 to 90 % [ms]", (step.rise_time_s for step in steps), 1e3),
        _row("final speed [rad/s]", (step.final_speed_rad_s for step in steps)),
    ]
    assert found.exactly.open_loop is not None and found.as_published.open_loop is not None
    assert found.extended.open_loop is not None
    final = ours.final_speed_rad_s.measured.value
    return {
        "step_table": table(COMPARED, rows),
        "final_speed": final,
        "final_rpm": final * RPM,
        "trials": ours.trials,
        "exact_fit": found.exactly.open_loop.pooled.fit_percent,
        "named_fit": found.extended.open_loop.pooled.fit_percent,
        "named_chi2": found.extended.open_loop.pooled.chi2_per_sample,
        "exact_chi2": found.exactly.open_loop.pooled.chi2_per_sample,
        "paper_fit": found.as_published.open_loop.pooled.fit_percent,
        "rise_low": 1e3 * ours.rise_time_s.measured.low,
        "rise_high": 1e3 * ours.rise_time_s.measured.high,
        "named_rise": 1e3 * named.rise_time_s.predicted.value,
        "paper_rise": 1e3 * theirs.rise_time_s.predicted.value,
    }


def _closed_loop(found: "Found") -> dict[str, float | str]:
    loops = [each.closed_loop[0] for each in (found.extended, found.exactly, found.as_published)]
    named, ours, theirs = loops
    rows = [
        _row("rise time [ms]", (loop.rise_time_s for loop in loops), 1e3),
        _row("overshoot [% of the final speed]", (loop.overshoot_percent for loop in loops)),
        _row("steady error [rad/s]", (loop.steady_error_rad_s for loop in loops)),
        _row("at the supply's limit [% of ticks]", (loop.saturated_percent for loop in loops)),
    ]
    error = ours.theory_error_rad_s.value
    return {
        "loop_table": table(COMPARED, rows),
        "simulations": found.exactly.simulations,
        "reference": ours.reference_rad_s,
        "exact_error": error,
        "exact_error_rpm": error * RPM,
        "paper_error": theirs.theory_error_rad_s.value,
        "named_error_low": named.steady_error_rad_s.predicted.low,
        "named_error_high": named.steady_error_rad_s.predicted.high,
        "measured_error": ours.steady_error_rad_s.measured.value,
        "smooth_error": ours.reference_rad_s / (1 + ours.gain_V_s_rad * GAIN),
        "saturated": ours.saturated_percent.measured.value,
        **_inside("exact", found.exactly),
        **_inside("paper", found.as_published),
    }


def _inside(name: str, validation: Validation) -> dict[str, float]:
    loops = validation.closed_loop
    return {
        f"{name}_speed_inside": float(np.mean([loop.speed_inside_percent for loop in loops])),
        f"{name}_volts_inside": float(np.mean([loop.volts_inside_percent for loop in loops])),
    }
