"""The report on one motor: from the recording to what to do, in the order in which one would tell it."""

from pathlib import Path

from jaxmotor._files import write_text
from jaxmotor.present.report._checks import checks_section
from jaxmotor.present.report._gain import gain_section, model_section
from jaxmotor.present.report._limits import again_section, limits_section
from jaxmotor.present.report._motor import motor_section
from jaxmotor.present.report._named import named_section
from jaxmotor.present.report._page import Section, page
from jaxmotor.present.report._response import response_section
from jaxmotor.present.report._story import Story, digest
from jaxmotor.present.report._summary import motor_name, summary
from jaxmotor.present.report._wrong import wrong_section

LONGEST_TITLE = 120


def report_page(story: Story, sha256: str) -> str:
    """The report as one HTML page; `sha256` is that of the recording's file."""
    sections = [
        Section("motor", "The motor and its recording", motor_section(story)),
        Section("response", "Frequency response", response_section(story)),
        Section("wrong", "What the linear model gets wrong", wrong_section(story)),
        Section("why", "Why", named_section(story)),
        Section("model", "The model", model_section(story)),
        Section("gain", "How well both models predict", gain_section(story)),
        Section("checks", "Steps and closed loops", checks_section(story)),
        Section("limits", "What the data cannot tell", limits_section(story)),
        Section("again", "How to get this again", again_section(story, sha256)),
    ]
    return page(_title(story), summary(story), sections)


def write_report(story: Story, source: Path, folder: Path) -> Path:
    """Write the report on the recording in `source` into `folder`, as `NAME.html`, and return its path."""
    return write_text(folder / f"{source.stem}.html", report_page(story, digest(source)))


def _title(story: Story) -> str:
    title = motor_name(story)
    return title if len(title) <= LONGEST_TITLE else title[: LONGEST_TITLE - 1] + "…"
