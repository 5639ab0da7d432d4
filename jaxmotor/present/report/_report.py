"""The report on one motor: from the recording to what to do, in the order in which one would tell it."""

from pathlib import Path

from jaxmotor._files import write_text
from jaxmotor.present.report._checks import checks_section
from jaxmotor.present.report._gain import gain_section, model_section
from jaxmotor.present.report._html import Content, element, paragraph
from jaxmotor.present.report._limits import again_section, limits_section
from jaxmotor.present.report._motor import motor_section
from jaxmotor.present.report._named import named_section
from jaxmotor.present.report._page import Section, cards, page
from jaxmotor.present.report._response import response_section
from jaxmotor.present.report._story import Story, digest
from jaxmotor.present.report._wrong import wrong_section
from jaxmotor.words import named, with_error

VERDICTS = {
    "complete": "A linear motor describes this recording down to its noise.",
    "extended": "A linear motor does not describe this recording; with {names} it does.",
    "undecided": "A linear motor describes this recording down to its noise, but {names} would not show under this "
    "input and would move gain or pole.",
    "unexplained": "A linear motor does not describe this recording, and {names}: see what it looks like.",
}
LONGEST_TITLE = 120


def report_page(story: Story, sha256: str) -> str:
    """The report as one HTML page; `sha256` is that of the recording's file."""
    sections = [
        Section("motor", "The motor and its recording", motor_section(story)),
        Section("response", "Frequency response", response_section(story)),
        Section("wrong", "What the linear model gets wrong", wrong_section(story)),
        Section("why", "Why", named_section(story)),
        Section("model", "The model", model_section(story)),
        Section("gain", "What it is worth", gain_section(story)),
        Section("checks", "Steps and closed loops", checks_section(story)),
        Section("limits", "What the data cannot tell", limits_section(story)),
        Section("again", "How to get this again", again_section(story, sha256)),
    ]
    return page(_title(story), _lead(story), sections)


def write_report(story: Story, source: Path, folder: Path) -> Path:
    """Write the report on the recording in `source` into `folder`, as `NAME.html`, and return its path."""
    path = folder / f"{source.stem}.html"
    write_text(path, report_page(story, digest(source)))
    return path


def _title(story: Story) -> str:
    title = str(story.recording.header.get("motor") or story.recording.name)
    return title if len(title) <= LONGEST_TITLE else title[: LONGEST_TITLE - 1] + "…"


def _lead(story: Story) -> Content:
    """What somebody who reads no further should know."""
    diagnosis = story.diagnosis
    linear, error, held_out = diagnosis.motor.linear, diagnosis.standard_error, diagnosis.held_out
    before, after, extended = held_out.before, held_out.after, bool(diagnosis.effects)
    entries: list[tuple[str, Content]] = [
        ("gain", with_error(float(linear.gain), error["gain_rad_s_V"], "rad/s/V")),
        ("pole", with_error(float(linear.pole), error["pole_rad_s"], "rad/s")),
        ("causes named", ", ".join(named(found.name) for found in diagnosis.effects) or "none"),
        ("fit of data not fitted", _change(before.fit_percent, after.fit_percent, extended, "{:.1f} %")),
        ("chi2 per sample, 1 = noise", _change(before.chi2_per_sample, after.chi2_per_sample, extended, "{:.3g}")),
    ]
    verdict = element("strong", diagnosis.verdict, id="verdict")
    return [
        paragraph(f"{story.recording.name}, identified from what was applied and what the shaft did", class_="quiet"),
        element("div", paragraph(verdict, ": ", _verdict(story)), cards(entries), class_="verdict"),
    ]


def _verdict(story: Story) -> str:
    if story.diagnosis.undecided:
        return VERDICTS["undecided"].format(names=" or ".join(one.phrase for one in story.diagnosis.open_hypotheses))
    names = " and ".join(named(found.name) for found in story.diagnosis.effects)
    if story.diagnosis.verdict == "unexplained":
        do = "does" if len(story.diagnosis.effects) == 1 else "do"
        names = f"{names} {do} not explain all of it" if names else "no cause in the vocabulary explains it"
    return VERDICTS[story.diagnosis.verdict].format(names=names)


def _change(before: float, after: float, extended: bool, form: str) -> str:
    first = form.format(before)
    return f"{first} → {form.format(after)}" if extended else first
