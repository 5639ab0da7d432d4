"""A foreign log as a table of cells, whatever kind of file it is."""

import functools
import os
from collections.abc import Mapping
from pathlib import Path

from jaxmotor._arguments import path_of
from jaxmotor.recording._damaged import whole_table
from jaxmotor.recording._matlab import is_matlab, read_matlab
from jaxmotor.recording._read_table import read_table
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table


def column_names(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Of the log at `path`, as they are to be stated.

    **Raises:** `RecordingError` where they cannot be read, or there are none.
    """
    return tuple(opened(path_of(path, "the path of a log"), {}).cells)


def opened(
    path: Path,
    stated: Mapping[str, str | None],
    drop_first: int = 0,
    decimal_comma: bool = False,
    drop_damaged: bool = False,
) -> Table:
    """The log at `path`, a CSV or a file of MATLAB, which has the columns that are `stated`.

    **Raises:** `RecordingError`.
    """
    columns, time = stated.get("columns"), stated.get("time")
    named = {key: one for key, one in stated.items() if one is not None and key not in ("wrap", "columns", "only")}
    names = list(named.values())
    if is_matlab(path):
        if columns is not None or decimal_comma or drop_damaged:
            others = "--columns, --decimal-comma and --drop-damaged"
            raise RecordingError(f"{path}: the variables have names and numbers; leave {others} out")
        return read_matlab(path, drop=drop_first, stated=names)
    read = functools.partial(
        read_table, path, columns=columns, drop=drop_first, decimal_comma=decimal_comma, stated=names
    )
    numbers = [one for key, one in named.items() if key != "segment"]
    return whole_table(lambda drop: read(drop_damaged=drop), numbers, time, drop_damaged)
