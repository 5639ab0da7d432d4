"""Results as text for people."""

import math
from pathlib import Path

from jaxmotor.estimate import Fit, to_json
from jaxmotor.recording import ranges
from jaxmotor.words import allowing, floor, noise_words, with_error

RPM = 60 / (2 * math.pi)
"""rpm in one rad/s."""


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
    if fit.method == "exact":
        lines.append(f"  offset  {with_error(1e3 * fit.offset_V, 1e3 * fit.offset_standard_error_V, 'mV')}")
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
