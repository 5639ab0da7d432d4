"""Writes docs/paper.md (from paper_page.md) and its pictures: the paper's tables, equations and figures beside ours.

    make firmware && python benchmarks/paper.py

Ours are of the bundled recording "paper", which the firmware made on the emulated bench by the paper's plan; its motor
has 0.2 V of friction. The extra delay is taken apart by benchmarks/delay.py on the bench's motor itself.
"""

import dataclasses
from pathlib import Path
from typing import NamedTuple

import delay
import numpy as np
from _paper_values import PERIODS_S, SINE_HZ, values
from _pictures import save_small
from matplotlib.figure import Figure

from jaxmotor._files import write_text
from jaxmotor.bench import resolution_table
from jaxmotor.diagnosis import Diagnosis, diagnose, extended_model
from jaxmotor.estimate import Fit, identify, model_of
from jaxmotor.present import bode, bode_models, controller, encoder, position_drift, sine_fit, step_trials, zoh_bode
from jaxmotor.present._style import BLUE, GREY, MEASURED, PURPLE, VERMILLION, panels, styled
from jaxmotor.recording import Recording, bundled
from jaxmotor.validation import Validation, validate

DOCS = Path(__file__).parent.parent / "docs"
FRICTIONS_V = (0.0, 0.2, 0.5)
PAGE = Path(__file__).parent / "paper_page.md"


class Found(NamedTuple):
    """What the recordings give."""

    recording: Recording
    exact: Fit
    paper: Fit
    without_friction: Fit
    """By the paper's method, of a motor that is linear."""
    exactly_without_friction: Fit
    named: Diagnosis
    """Of the segments that are not held out."""
    exactly: Validation
    as_published: Validation
    extended: Validation
    """Of the motor with the effects that were named."""
    parts: dict[float, delay.Parts]
    """By friction [V]."""

    @property
    def sine(self) -> int:
        """The segment whose frequency is nearest to that of Fig. 6 and 7."""
        sines = [k for k in self.exact.fitted if self.recording.segments[k].kind == "sine"]
        return min(sines, key=lambda k: abs(float(self.recording.segments[k].parameters["frequency_Hz"]) - SINE_HZ))


def find() -> Found:
    """Half of the steps and the loops are held out, for the validation."""
    recording = bundled("paper")
    kinds = [segment.kind for segment in recording.segments]
    steps = [index for index, kind in enumerate(kinds) if kind == "step"]
    held_out = [*steps[len(steps) // 2 :], *(index for index, kind in enumerate(kinds) if kind == "closed_loop")]
    exact = identify(recording, hold_out=held_out)
    paper = identify(recording, method="paper", hold_out=held_out)
    rest = tuple(segment for index, segment in enumerate(recording.segments) if index not in held_out)
    named = diagnose(dataclasses.replace(recording, segments=rest))
    return Found(
        recording,
        exact,
        paper,
        identify(bundled("linear"), method="paper"),
        identify(bundled("linear")),
        named,
        validate(model_of(exact), recording),
        validate(model_of(paper), recording),
        validate(extended_model(named), recording),
        {friction: delay.parts(friction) for friction in FRICTIONS_V},
    )


@styled
def delay_parts(parts: dict[float, delay.Parts]) -> Figure:
    """The phase beyond the paper's model, and its parts, without and with friction."""
    figure, axes = panels(1, 2.8, columns=len(parts), share_y=True)
    frequency = np.array(delay.FREQUENCIES_HZ)
    for ax, (friction, found) in zip(axes[0], parts.items(), strict=True):
        others = found.electrical + found.timer + found.duty + found.start
        ax.plot(frequency, found.difference, color=VERMILLION, linestyle="--", label="count difference")
        ax.plot(frequency, found.friction, color=PURPLE, linestyle="-.", label="friction")
        ax.plot(frequency, others, color=GREY, linestyle=":", label="all others")
        ax.plot(frequency, found.together, color=BLUE, label="sum")
        ax.plot(frequency, found.seen, label="seen", **MEASURED)
        ax.set(xlabel="Frequency (Hz)")
        ax.set_title(f"friction {friction:g} V", loc="right", fontsize=7.5)
    axes[0, 0].set_ylabel("Beyond the paper's model\n(degrees)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=5)
    return figure


def figures(found: Found) -> dict[str, Figure]:
    """By the number that each has in the paper."""
    recording, sine = found.recording, found.sine
    assert recording.period_s is not None and recording.counts_per_rev is not None
    assert found.exact.frequency_response is not None
    pole = float(found.exact.motor.pole)
    return {
        "table-1": encoder(recording.counts_per_rev, resolution_table(recording.counts_per_rev, PERIODS_S), (37.7,)),
        "fig-3": zoh_bode(recording.period_s, found.exact.motor),
        "fig-6": position_drift(recording, sine, pole_rad_s=pole),
        "fig-7": sine_fit(recording, sine, pole_rad_s=pole),
        "fig-8": bode(found.exact.frequency_response),
        "fig-9": bode_models(found.exact.frequency_response, [found.exact, found.paper]),
        "delay": delay_parts(found.parts),
        "fig-10": step_trials(found.exactly.steps[0]),
        "fig-12": controller(found.exactly.closed_loop[0]),
    }


def main() -> None:
    found = find()
    folder = DOCS / "img" / "paper"
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures(found).items():
        path = save_small(figure, folder / f"{name}.png")
        print(f"{path.name:14s} {path.stat().st_size / 1e3:5.1f} kB")
    write_text(DOCS / "paper.md", PAGE.read_text(encoding="utf-8").format_map(values(found)))
    print(DOCS / "paper.md")


if __name__ == "__main__":
    main()
