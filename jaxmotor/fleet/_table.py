"""Results as a table: one row for each motor, numbers in SI with their units in the names."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import replacing
from jaxmotor._json import plain
from jaxmotor.fleet._batch import Identified
from jaxmotor.fleet._dataset import Entry
from jaxmotor.fleet._diagnosed import DIAGNOSIS_NUMBERS, DIAGNOSIS_TEXTS, EFFECTS
from jaxmotor.fleet._extra import needs
from jaxmotor.fleet._friction import FrictionFit

Row = dict[str, Any]

TEXTS = ("motor", "source", "problem")
NUMBERS: dict[str, Callable[[Identified], Any]] = {
    "gain_rad_s_V": lambda found: found.assessment.motor.gain,
    "pole_rad_s": lambda found: found.assessment.motor.pole,
    "voltage_offset_V": lambda found: found.assessment.offset_V,
    "gain_standard_error_rad_s_V": lambda found: found.assessment.standard_error.gain,
    "pole_standard_error_rad_s": lambda found: found.assessment.standard_error.pole,
    "voltage_offset_standard_error_V": lambda found: found.assessment.offset_standard_error_V,
    "gain_pole_covariance_rad2_s2_V": lambda found: found.assessment.covariance[0, 1],
    "chi2_per_sample": lambda found: found.chi2_per_sample,
    "fit_percent": lambda found: found.fit_percent,
}
"""Columns of numbers, and where each is in what was identified."""
FRICTION_NUMBERS = (
    "friction_gain_rad_s_V",
    "friction_pole_rad_s",
    "coulomb_friction_V",
    "dead_zone_V",
    "friction_gain_standard_error_rad_s_V",
    "friction_pole_standard_error_rad_s",
    "coulomb_friction_standard_error_V",
    "dead_zone_standard_error_V",
    "friction_chi2_per_sample",
)
KEY = b"jaxmotor fleet"
"""Metadata of a file of results: what they are the results of, as JSON."""


def row_of(entry: Entry, found: Identified | None, problem: str, friction: FrictionFit | None = None) -> Row:
    """One motor's row; where there is a `problem` its numbers are missing."""
    row: Row = {"motor": entry.motor, "source": entry.source, "problem": problem or None}
    row |= dict.fromkeys((*NUMBERS, *FRICTION_NUMBERS))
    row["notes"] = [] if found is None else list(found.notes)
    if found is not None:
        row |= plain({name: float(number(found)) for name, number in NUMBERS.items()})
    if friction is not None:
        row |= dict(zip(FRICTION_NUMBERS, plain(friction.numbers()), strict=True))
    return row


def write_rows(rows: list[Row], path: Path, about: Mapping[str, Any]) -> None:
    """Write `rows` to `path`, whole or not at all; `about` says what they are the results of."""
    table = needs("pyarrow").Table.from_pylist(rows, schema=_schema(about))
    with replacing(path) as part:
        needs("pyarrow.parquet").write_table(table, part, compression="zstd")


def read_about(path: Path) -> Mapping[str, Any] | None:
    """What the results in `path` are of; None where it holds no results."""
    parquet = needs("pyarrow.parquet")
    try:
        metadata = parquet.read_schema(path).metadata or {}
        return json.loads(metadata[KEY])
    except (OSError, ValueError, KeyError):
        return None


def doubled_names(files: Iterable[Path]) -> set[str]:
    """Names that more than one motor of the results in `files` has."""
    parquet, seen, twice = needs("pyarrow.parquet"), set(), set()
    for file in files:
        for name in parquet.read_table(file, columns=["motor"]).column("motor").to_pylist():
            (twice if name in seen else seen).add(name)
    return twice


def join(parts: list[Path], path: Path, about: Mapping[str, Any]) -> None:
    """All `parts` in one file, row group by row group, a note added where two motors have one name."""
    arrow, parquet = needs("pyarrow"), needs("pyarrow.parquet")
    twice, schema = doubled_names(parts), _schema(about)
    with replacing(path) as whole, parquet.ParquetWriter(whole, schema, compression="zstd") as writer:
        for part in parts:
            rows = parquet.read_table(part).to_pylist()
            for row in rows:
                if row["motor"] in twice:
                    row["notes"] = [*row["notes"], "another motor of this data set has this name: see their sources"]
            writer.write_table(arrow.Table.from_pylist(rows, schema=schema))


def read_results(path: Path) -> dict[str, np.ndarray]:
    """The columns of a file of results, without the motors that have a problem; missing numbers are NaN, texts None.

    **Raises:** `JaxmotorError` where it holds no results, or is not there.
    """
    if not path.is_file():
        raise JaxmotorError(f"{path}: is not a file; give the results of `jaxmotor fleet`")
    if read_about(path) is None:
        raise JaxmotorError(f"{path}: holds no results of `jaxmotor fleet`; make them with it")
    table = needs("pyarrow.parquet").read_table(path)
    columns = {name: table.column(name).to_numpy() for name in table.column_names if name != "notes"}
    good = np.array([problem is None for problem in columns.pop("problem")], bool)
    return {name: np.asarray(column)[good] for name, column in columns.items()}


class Verdicts(NamedTuple):
    """What came of diagnosing a data set."""

    verdicts: tuple[tuple[tuple[str, str], int], ...]
    """Verdict and effects, "coulomb_friction + backlash" or "no effect", and their number of motors; the most first."""
    failed: int
    """Motors that could not be diagnosed."""


def count_verdicts(path: Path) -> Verdicts:
    """How many motors of the results in `path` have which verdict."""
    table = needs("pyarrow.parquet").read_table(path, columns=["verdict", EFFECTS, "diagnosis_problem"])
    counts: Counter[tuple[str, str]] = Counter()
    for row in table.to_pylist():
        if row["verdict"] is not None:
            counts[row["verdict"], " + ".join(row[EFFECTS]) or "no effect"] += 1
    return Verdicts(tuple(counts.most_common()), len(table) - table.column("diagnosis_problem").null_count)


def _schema(about: Mapping[str, Any]) -> Any:
    arrow = needs("pyarrow")
    fields: Iterable[Any] = [
        *((name, arrow.string()) for name in TEXTS),
        *((name, arrow.float64()) for name in (*NUMBERS, *FRICTION_NUMBERS, *DIAGNOSIS_NUMBERS)),
        *((name, arrow.string()) for name in DIAGNOSIS_TEXTS),
        (EFFECTS, arrow.list_(arrow.string())),
        ("notes", arrow.list_(arrow.string())),
    ]
    return arrow.schema(fields, metadata={KEY: json.dumps(dict(about))})
