"""What an identification, a diagnosis and a validation leave in a folder: models, figures and plans."""

import json
import math
from pathlib import Path

from matplotlib.figure import Figure

from jaxmotor._files import write_text
from jaxmotor.diagnosis import Diagnosis, extended_model
from jaxmotor.estimate import Fit, Model, model_to_json, to_json
from jaxmotor.present._before_after import before_after
from jaxmotor.present._bode import bode, bode_models
from jaxmotor.present._causes import causes, probabilities
from jaxmotor.present._fit import residuals, simulation
from jaxmotor.present._learned import learned
from jaxmotor.present._overview import overview
from jaxmotor.present._residual_voltage import residual_voltage
from jaxmotor.present._save import save
from jaxmotor.present._sine import position_drift, sine_fit
from jaxmotor.present._validation import controller, step_trials
from jaxmotor.recording import Recording
from jaxmotor.validation import Validation

PAPER_SINE_HZ = 5.0
"""The sine of the paper's Fig. 6 and 7; the nearest one is drawn."""


def write_fit(fit: Fit, recording: Recording, folder: Path) -> list[Path]:
    """Write the model (`NAME.json`) and the figures of `fit` (`NAME-*.png`) into `folder`, and return their paths."""
    stem = Path(recording.name).stem
    model = write_text(folder / f"{stem}.json", json.dumps(to_json(fit), indent=2) + "\n")
    return [model, *_write(fit_figures(fit, recording), folder, stem)]


def write_validation(validation: Validation, recording: Recording, folder: Path) -> list[Path]:
    """Write the figures of `validation` (`NAME-*.png`) into `folder`, and return their paths."""
    return _write(validation_figures(validation, recording), folder, Path(recording.name).stem)


def write_diagnosis(diagnosis: Diagnosis, recording: Recording, folder: Path) -> list[Path]:
    """Write the figures of `diagnosis` (`NAME-*.png`), and where effects were named the extended model
    (`NAME-extended.json`) and plans of what to record next (`NAME-next-1.toml`), and return their paths."""
    stem = Path(recording.name).stem
    written = _write(diagnosis_figures(diagnosis), folder, stem)
    if diagnosis.named:
        content = json.dumps(model_to_json(extended_model(diagnosis)), indent=2)
        written.append(write_text(folder / f"{stem}-extended.json", content + "\n"))
    plans = [one.plan for one in diagnosis.experiments if one.plan is not None]
    for number, plan in enumerate(plans, 1):
        written.append(write_text(folder / f"{stem}-next-{number}.toml", plan))
    return written


def fit_figures(fit: Fit, recording: Recording) -> dict[str, Figure]:
    """The figures that `fit` has the data for, by name."""
    figures = {"simulation": simulation(fit, recording), "residuals": residuals(fit, recording)}
    if fit.frequency_response is not None:
        figures["bode"] = bode(fit.frequency_response)
        figures["models"] = bode_models(fit.frequency_response, [fit])
    sine = nearest_sine(fit, recording)
    if sine is not None:
        pole = float(fit.motor.pole)
        figures["sine"] = sine_fit(recording, sine, pole_rad_s=pole)
        if recording.measured != "speed":
            figures["drift"] = position_drift(recording, sine, pole_rad_s=pole)
    return figures


def diagnosis_figures(diagnosis: Diagnosis) -> dict[str, Figure]:
    """The figures that `diagnosis` has the data for, by name."""
    figures = {"missing": residual_voltage(diagnosis)} if len(diagnosis.residual_voltage.volts) else {}
    if diagnosis.named:
        figures |= {
            "probabilities": probabilities(diagnosis),
            "causes": causes(diagnosis),
            "before-after": before_after(diagnosis),
        }
    if diagnosis.learned:
        figures["learned"] = learned(diagnosis.learned)
    return figures


def validation_figures(validation: Validation, recording: Recording) -> dict[str, Figure]:
    """The figures that `validation` has the data for, by name."""
    figures = {}
    if validation.open_loop is not None:
        figures["open-loop"] = simulation(validation.open_loop, recording)
    for number, trials in enumerate(validation.steps, 1):
        figures[f"step-{number}"] = step_trials(trials)
    for loop in validation.closed_loop:
        figures[f"closed-loop-{loop.segment}"] = controller(loop)
    return figures


def picture(result: object) -> Figure | None:
    """The one figure of `result` that tells most; None where it has none."""
    if isinstance(result, Fit):
        return simulation(result)
    if isinstance(result, Recording):
        return overview(result)
    if isinstance(result, Diagnosis):
        return residual_voltage(result) if len(result.residual_voltage.volts) else None
    if isinstance(result, Model):
        return None if result.response is None else bode(result.response)
    loop = result.open_loop if isinstance(result, Validation) else None
    return None if loop is None else simulation(loop)


def nearest_sine(fit: Fit, recording: Recording) -> int | None:
    """The fitted sine segment whose frequency is nearest to the paper's; None where there is none."""
    sines = {index: frequency for index in fit.fitted if (frequency := recording.segments[index].sine_Hz) is not None}
    return min(sines, key=lambda index: abs(math.log(sines[index] / PAPER_SINE_HZ)), default=None)


def _write(figures: dict[str, Figure], folder: Path, stem: str) -> list[Path]:
    paths = [folder / f"{stem}-{name}.png" for name in figures]
    for path, figure in zip(paths, figures.values(), strict=True):
        save(figure, path)
    return paths
