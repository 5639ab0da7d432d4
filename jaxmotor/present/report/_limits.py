"""What is not identifiable, what to record next, and how to get the same numbers again."""

import importlib.metadata
import json
import platform
import shlex

from jaxmotor.diagnosis import Diagnosis, to_json
from jaxmotor.present.report._html import Content, bullets, details, element, paragraph, table
from jaxmotor.present.report._story import Story
from jaxmotor.text import allowing, capital, may_be, named, spoken

PACKAGES = ("jaxmotor", "jax", "jaxlib", "equinox", "optimistix", "numpy")
MOST_EXPERIMENTS = 3
OVERESTIMATED = 0.5
"""chi2 per sample below which the noise was not what it was taken for."""


def limits_section(story: Story) -> Content:
    """What is not identifiable, the notes of the fit and the diagnosis, and what to record next."""
    diagnosis, recording = story.diagnosis, story.recording
    current = any(segment.current_A is not None for segment in recording.segments)
    limits = [] if current else [
        "From voltage and shaft alone, gain and pole are identifiable, but not resistance, torque constant and "
        "inertia one by one. Torques are given as the voltage that overcomes them."
    ]  # fmt: skip
    if recording.duty_full_scale is not None and recording.supply_V is not None:
        limits.append(
            f"Volts are duties times the supply of {recording.supply_V:.4g} V that the recording states: if that is "
            "1 % too low, the gain is 1 % too high, and volts are 1 % too low. No interval here includes that."
        )
    for found in diagnosis.named:
        same = may_be(found, named)
        if same is not None:
            limits.append(f"{named(found.name)}: {same}")
    if not diagnosis.fit.floor_known:
        limits.append("The noise is not known beforehand, as it is of counts, but was estimated from the data.")
    if diagnosis.held_out.after.chi2_per_sample < OVERESTIMATED:
        limits.append(
            "The residual is less than that estimate of the noise, which was too large: chi2 says which motor is "
            "better, not whether anything is unexplained."
        )
    left_open = allowing(diagnosis)
    limits += [] if left_open is None else [left_open]
    notes = [*diagnosis.notes, *(story.validation.notes if story.validation else ())]
    return [bullets(capital(f"{spoken(text).rstrip('.')}.") for text in limits + notes), _next(diagnosis)]


def _next(diagnosis: Diagnosis) -> Content:
    told = [one for one in diagnosis.experiments if one.plan is not None][:MOST_EXPERIMENTS]
    if not told:
        return None
    plans = [details(f"The plan: {spoken(one.text)}", element("pre", one.plan)) for one in told]
    return [element("h3", "What to record next"), bullets(f"{spoken(one.text)}." for one in told), plans]


def again_section(story: Story, digest: str) -> Content:
    """Commands, versions, seed, the recording's digest, and all numbers as JSON."""
    name = shlex.quote(story.recording.name)
    commands = [
        f"jaxmotor report {name} -o . --seed {story.seed}",
        f"jaxmotor diagnose {name} --seed {story.seed} --json",
    ]
    rows = [("recording", story.recording.name), ("its SHA-256", element("code", digest)), ("seed", str(story.seed))]
    rows += [(package, version) for package, version in versions().items()]
    numbers = json.dumps(to_json(story.diagnosis), indent=1, ensure_ascii=False)
    block = element("pre", numbers, tabindex="0", id="diagnosis")
    return [
        paragraph("The same recording, versions and seed give the same numbers."),
        element("pre", "\n".join(commands), tabindex="0"),
        table("What this page was made of", ("what", "value"), rows),
        details("All numbers of the diagnosis, as JSON", block, printed=False),
    ]


def versions() -> dict[str, str]:
    """Of the packages that numbers depend on, and of Python and the machine's kind."""
    found = {package: importlib.metadata.version(package) for package in PACKAGES}
    return found | {"Python": platform.python_version(), "machine": f"{platform.system()} {platform.machine()}"}
