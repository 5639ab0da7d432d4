"""The page on a fleet: its motors in a table to sort, what they have in common, and who does not belong."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import write_text
from jaxmotor.fleet import Population, population, read_results
from jaxmotor.present._population import MOST_BARS, drawn_motors, population_figure
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._fleet_causes import MOST_LISTED, causes_section, diagnosed, more
from jaxmotor.present.report._html import Content, Html, details, element, number, paragraph, table, unbroken
from jaxmotor.present.report._limits import versions
from jaxmotor.present.report._page import Section, cards, figure, page
from jaxmotor.present.report._story import digest
from jaxmotor.text import RPM, plainly, with_error

MOST_MOTORS = 3_000
"""In the table; who does not belong or failed is listed in any case."""
COLUMNS = {
    "gain_rad_s_V": ("gain (rad/s/V)", 1.0, "gain_standard_error_rad_s_V"),
    "pole_rad_s": ("pole (rad/s)", 1.0, "pole_standard_error_rad_s"),
    "coulomb_friction_V": ("Coulomb friction (mV)", 1e3, "coulomb_friction_standard_error_V"),
    "dead_zone_V": ("dead zone (mV)", 1e3, "dead_zone_standard_error_V"),
    "chi2_per_sample": ("chi2 per sample", 1.0, ""),
    "fit_percent": ("fit (%)", 1.0, ""),
}
FRICTION = ("coulomb_friction_V", "dead_zone_V")
WORDS = {name: title.partition(" (")[0] for name, (title, _, _) in COLUMNS.items()}


def fleet_page(results: Path) -> str:
    """The page on the `results` of `jaxmotor fleet`.

    **Raises:** `JaxmotorError` where the file holds none.
    """
    columns = read_results(results)
    # Not before: where the package is missing, reading the results has said so.
    from pyarrow import parquet

    rows = parquet.read_table(results).to_pylist()
    failed = [row for row in rows if row["problem"] is not None]
    good = [row for row in rows if row["problem"] is None]
    found, why_not = _population(columns)
    sections = [
        Section("spread", "What the motors have in common", _spread(found, why_not)),
        Section("outliers", "Motors that do not belong", _outliers(found, good)),
        Section("causes", "What the linear models get wrong", causes_section(rows)),
        Section("failed", "Motors that could not be identified", _failed(failed)),
        Section("motors", "All motors", _motors(good, found)),
        Section("again", "How to get this again", _again(results)),
    ]
    entries: list[tuple[str, Content]] = [
        ("motors", str(len(rows))),
        ("do not belong", str(len(found.outliers)) if found and _is_telling(found) else "not known"),
        ("could not be identified", str(len(failed))),
    ]
    lead = [element("div", paragraph(_sentence(rows, found)), cards(entries), class_="verdict")]
    return page(f"Fleet: {results.name}", lead, sections)


def write_fleet_page(results: Path, folder: Path) -> Path:
    """Write the page on `results` into `folder`, as `NAME.html`, and return its path."""
    return write_text(folder / f"{results.stem}.html", fleet_page(results))


def _population(columns: dict[str, np.ndarray]) -> tuple[Population | None, str]:
    """Of gain, pole, and friction where that was fitted; or why there is none."""
    friction = np.isfinite(columns["coulomb_friction_V"].astype(float)).any()
    names = ("gain_rad_s_V", "pole_rad_s", *(("coulomb_friction_V",) if friction else ()))
    try:
        return population(columns, names), ""
    except JaxmotorError as error:
        return None, str(error)


def _is_telling(found: Population) -> bool:
    """There are enough motors to say of one that it does not belong; or none differs."""
    return bool(np.isfinite(found.threshold))


def _sentence(rows: Sequence[dict[str, Any]], found: Population | None) -> str:
    """The fleet in plain words: how many motors are alike, and in what."""
    failed = sum(row["problem"] is not None for row in rows)
    told = [f"{len(rows) - failed} of {len(rows)} motors were identified."]
    if found is None:
        return " ".join([*told, "They are too few to say how they differ, or which one does not belong."])
    alike = dict(zip(found.names, zip(found.sizes(found.mean), found.spread, strict=True), strict=True))
    (gain, gain_spread), (pole, pole_spread) = alike["gain_rad_s_V"], alike["pole_rad_s"]
    told.append(
        f"Their middle turns at {RPM * gain:.4g} rpm/V (standard deviation between motors {100 * gain_spread:.2g} %), "
        f"with a time constant of {1e3 / pole:.4g} ms ({100 * pole_spread:.2g} %)."
    )
    return " ".join([*told, _belonging(found)])


def _belonging(found: Population) -> str:
    if not _is_telling(found):
        return "They are too few to say which one does not belong."
    number_outside = len(found.outliers)
    if not number_outside:
        return "All of them belong together."
    return f"{number_outside} {'does' if number_outside == 1 else 'do'} not belong with the others."


def _spread(found: Population | None, why_not: str) -> Content:
    if found is None:
        return paragraph(f"Not known: {why_not}.")
    rows = []
    columns = (found.names, found.sizes(found.mean), found.mean_error, found.spread, found.logarithmic)
    for name, middle, error, spread, is_size in zip(*columns, strict=True):
        _, factor, _ = COLUMNS[name]
        shown = with_error(factor * middle, (middle if is_size else factor) * error, "")
        wide = f"{100 * spread:.3g} %" if is_size else f"{factor * spread:.3g}"
        if name in found.without_spread:
            wide = "the same for all"
        rows.append([COLUMNS[name][0], number(middle, f"population.{name}", shown), wide])
    head = ("", "middle ± 95 %", "standard deviation between motors")
    text = "The spread is that of the motors themselves: what the errors of their estimates add to it is taken out."
    if "coulomb_friction_V" in found.names:
        text += " Gain and pole are those of the linear motor, which friction shifts: it lowers the gain."
    return [paragraph(text), table("Spread between motors", head, rows), _same(found), _drawing(found)]


def _drawing(found: Population) -> Html:
    """Gain against each other parameter; pointing at a motor names it."""
    gains = found.sizes(found.estimates)[:, 0]
    points = {
        label: [f"{gains[k]:.4g}, {found.motors[k][:60]}" for k in rows] for label, rows in drawn_motors(found).items()
    }
    outside = len(found.outliers)
    alt = f"{len(found.motors)} motors, gain against the other parameters; {outside} do not belong."
    drawn = drawing(population_figure(found), "population", alt=alt, nearest="point", points=points)
    bars = " with its 95 % interval" if len(found.motors) <= MOST_BARS else ""
    return figure(drawn, f"Each mark is a motor{bars}.")


def _same(found: Population) -> Content:
    """What the parameters without a spread are."""
    if not found.without_spread:
        return None
    names = " and ".join(WORDS[name] for name in found.without_spread)
    rest = "; distances are those of the others" if len(found.without_spread) < len(found.names) else ""
    text = f"The same for all motors, to the last digits, and so without a spread or a correlation: {names}{rest}."
    return paragraph(text)


def _outliers(found: Population | None, good: list[dict[str, Any]]) -> Content:
    if found is None:
        return None
    if not found.outliers:
        return paragraph(_none(found))
    causes = _causes(good)
    rows: list[list[Content]] = []
    for outlier in found.outliers[:MOST_LISTED]:
        because = [WORDS[outlier.because], f"{outlier.deviation:+.1f}"]
        diagnosis = [causes.get(outlier.motor, "")] if causes else []
        rows.append([outlier.motor, plainly(outlier.distance), *because, *diagnosis])
    head = ("motor", "distance (sd)", "because of its", "by (sd)", *(("its diagnosis",) if causes else ()))
    text = (
        f"Farther than {found.threshold:.2f} standard deviations from the rest; of a hundred fleets of motors of one "
        "kind, about four have such a motor."
    )
    return [paragraph(text), table("Motors that do not belong, the farthest first", head, rows), more(found.outliers)]


def _none(found: Population) -> str:
    """Why no motor stands out."""
    if len(found.without_spread) == len(found.names):
        return "None: the motors do not differ."
    if not np.isfinite(found.threshold):
        return "None can be told from so few motors."
    return f"None: all lie within {found.threshold:.2f} standard deviations."


def _causes(good: list[dict[str, Any]]) -> dict[str, str]:
    """What the diagnosis of each motor says, by its name; of those that share a name, all of it."""
    told: dict[str, list[str]] = {}
    for row in good:
        one = diagnosed(row)
        if one is not None:
            told.setdefault(row["motor"], []).append(one.told or one.verdict)
    return {motor: " / ".join(every) for motor, every in told.items()}


def _failed(failed: list[dict[str, Any]]) -> Content:
    if not failed:
        return paragraph("None.")
    causes = _causes(failed)
    rows = [
        (row["motor"], row["problem"], *((causes.get(row["motor"], ""),) if causes else ()))
        for row in failed[:MOST_LISTED]
    ]
    head = ("motor", "what is wrong", *(("its diagnosis",) if causes else ()))
    return [table("Why, motor by motor", head, rows), more(failed)]


def _motors(good: list[dict[str, Any]], found: Population | None) -> Content:
    names = [name for name in COLUMNS if name not in FRICTION or any(row[name] is not None for row in good)]
    causes = any(diagnosed(row) is not None for row in good)
    titles = ("motor", *(COLUMNS[name][0] for name in names), "belongs", *(("verdict", "effects") if causes else ()))
    head = [element("button", title, type="button") for title in titles]
    told_by = _belongs(found)
    rows = [
        [*_numbers(row, names), told_by.get(row["motor"], "not known"), *(_diagnosis(row) if causes else ())]
        for row in good[:MOST_MOTORS]
    ]
    caption = "Motors in the order of the data; a head of a column sorts by it. Intervals are ± 95 %."
    notes = [(row["motor"], note) for row in good for note in row["notes"] or ()][:MOST_LISTED]
    said = details("Notes on single motors", table("Notes", ("motor", "note"), notes)) if notes else None
    return [table(caption, head, rows), more(good, MOST_MOTORS), said]


def _belongs(found: Population | None) -> dict[str, str]:
    """Of each motor of which that is known, by its name: yes or no."""
    if found is None or not _is_telling(found):
        return {}
    return dict.fromkeys(found.motors, "yes") | {outlier.motor: "no" for outlier in found.outliers}


def _numbers(row: dict[str, Any], names: list[str]) -> list[Content]:
    """A motor's name and its numbers."""
    cells: list[Content] = [row["motor"]]
    for name in names:
        _, factor, error = COLUMNS[name]
        value = float("nan") if row[name] is None else float(row[name])
        if not np.isfinite(value):
            cells.append(element("data", "", value=""))
            continue
        spread = row[error] if error else None
        shown = plainly(value, 4) if spread is None else with_error(factor * value, factor * spread, "")
        cells.append(number(value, name, shown))
    return cells


def _diagnosis(row: dict[str, Any]) -> tuple[Content, Content]:
    one = diagnosed(row)
    return ("", "") if one is None else (unbroken(one.verdict), one.told)


def _again(results: Path) -> Content:
    rows: list[tuple[str, Content]] = [("results", results.name), ("their SHA-256", element("code", digest(results)))]
    return table("What this page was made of", ("what", "value"), rows + list(versions().items()))
