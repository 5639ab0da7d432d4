"""Results as text for people."""

from pathlib import Path

import numpy as np

from jaxmotor.estimate import Fit, to_json
from jaxmotor.recording import ranges
from jaxmotor.text import RPM, allowing, floor, noise_words, with_error

TURNS, ONE_WAY, OFFSET = 0.1, 0.99, 0.01
"""Share of the highest speed above which a motor turns, of these rows that go one way, and of the voltage of that speed
that an offset must exceed to be worth a word."""


def fit_text(fit: Fit, extra: list[str], written: list[Path]) -> str:
    """What `jaxmotor identify` prints of one recording."""
    content = to_json(fit)
    values, errors = content["model"], content["standard_error"]
    lines = [Path(fit.source).name]
    gain, pole = values["gain_rad_s_V"], values["pole_rad_s"]
    lines.append(f"  gain    {with_error(gain, errors['gain_rad_s_V'], 'rad/s/V')}  ({gain * RPM:.4g} rpm/V)")
    lines.append(f"  pole    {with_error(pole, errors['pole_rad_s'], 'rad/s')}  (time constant {1e3 / pole:.4g} ms)")
    if "electrical_time_constant_s" in values:
        tau, error = values["electrical_time_constant_s"], errors["electrical_time_constant_s"]
        lines.append(f"  L/R     {with_error(1e3 * tau, 1e3 * error, 'ms')}")
    if fit.has_offset:
        lines.append(f"  offset  {with_error(1e3 * fit.offset_V, 1e3 * fit.offset_standard_error_V, 'mV')}")
        lines += _opposing(fit)
    left_open = allowing(fit)
    lines += [f"  {left_open}"] if left_open else []
    lines.append(f"  noise   {noise_words(fit.noise)}")
    one = f"1 = {floor(fit.floor_known)}"
    lines.append(f"  fit     {fit.fit_percent:.1f} % of the speed; chi2 {fit.chi2_per_sample:.3g} per sample ({one})")
    held_out = f", held out {ranges(fit.held_out)}" if fit.held_out else ""
    lines.append(f"  scored on the fitted segments {ranges(fit.fitted)}{held_out}; ± is 95 %")
    lines += [f"  note: {note}" for note in (*fit.notes, *extra)]
    lines += [f"  wrote {path}" for path in written]
    return "\n".join(lines)


def _opposing(fit: Fit) -> list[str]:
    """What an offset against a motion of one direction may be: nothing else distinguishes it from friction."""
    speed = np.concatenate([np.zeros(1), *(trace.measured_rad_s for trace in fit.traces)])
    fastest = float(speed[np.argmax(np.abs(speed))])
    one_way = np.mean(speed[np.abs(speed) > TURNS * abs(fastest)] * fastest > 0) > ONE_WAY
    least = max(1.96 * fit.offset_standard_error_V, OFFSET * abs(fastest / float(fit.motor.gain)))
    if not one_way or fit.offset_V * np.sign(fastest) > -least:
        return []
    return [
        "  the offset opposes the motion, which has one direction: it may be Coulomb friction; see jaxmotor diagnose"
    ]
