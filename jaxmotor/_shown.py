"""Results as they show themselves: lines of text, a table in a notebook, a data frame."""

import base64
import html
import importlib
import io
import textwrap
from collections.abc import Mapping
from typing import Any, NamedTuple

from jaxmotor._errors import JaxmotorError
from jaxmotor._numbers import with_error
from jaxmotor._sentences import printable, sentence

LONGEST = 1000
DPI, WIDTH = 80, 110


class Row(NamedTuple):
    """A parameter [its unit]; 1.96 standard errors each way hold the truth 95 times of 100."""

    name: str
    value: float
    standard_error: float
    unit: str


class Shown:
    """Says what it holds: `_title`, `_rows` and `_remarks` are what a result tells of itself."""

    def _title(self) -> str:
        return type(self).__name__

    def _rows(self) -> tuple[Row, ...]:
        return ()

    def _remarks(self) -> tuple[str, ...]:
        return ()

    def __repr__(self) -> str:
        rows = self._rows()
        width = max((len(row.name) for row in rows), default=0)
        lines = [f"{row.name:{width}}  {with_error(row.value, row.standard_error, _unit(row))}" for row in rows]
        rest = [textwrap.fill(sentence(line, LONGEST), WIDTH, subsequent_indent="    ") for line in self._remarks()]
        return "\n  ".join([printable(self._title()), *lines, *rest])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th>{_text(row.name)}</th><td>{_text(with_error(row.value, row.standard_error, ''))}</td>"
            f"<td>{_text(_unit(row))}</td></tr>"
            for row in self._rows()
        )
        remarks = "".join(f"<li>{_text(remark)}</li>" for remark in self._remarks())
        table = f"<table><caption>{_text(self._title())}</caption>{rows}</table>"
        return f"<div>{table}<ul>{remarks}</ul>{_picture(self)}</div>"

    def to_dataframe(self) -> Any:
        """Parameters with value, standard error, 95 % interval and unit, as pandas' data frame, indexed by name.

        **Raises:** `JaxmotorError` where pandas is not installed.
        """
        names, values, errors, units = zip(*self._rows(), strict=True) if self._rows() else ((), (), (), ())
        ends = {
            end: [v + sign * 1.96 * e for v, e in zip(values, errors, strict=True)]
            for end, sign in (("low", -1), ("high", 1))
        }
        known = {"parameter": names, "value": values, "standard_error": errors, **ends, "unit": units}
        return data_frame(known).set_index("parameter")


def data_frame(columns: Mapping[str, Any]) -> Any:
    """`columns` as pandas' data frame. **Raises:** `JaxmotorError` where pandas is not installed."""
    try:
        import pandas  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise JaxmotorError("pandas is not installed; pip install pandas") from error
    return pandas.DataFrame(dict(columns))


def present() -> Any:
    """The folder that draws: it comes last in the story, and only whoever asks for a figure pays for matplotlib."""
    return importlib.import_module("jaxmotor.present")


def _unit(row: Row) -> str:
    """For people: a ratio has none."""
    return "" if row.unit == "1" else row.unit


def _text(text: str) -> str:
    return html.escape(sentence(text, LONGEST))


def _picture(result: Shown) -> str:
    """The one figure that tells most of `result`; only a notebook that shows it pays for matplotlib."""
    figure = present().picture(result)
    if figure is None:
        return ""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=DPI)
    data = base64.b64encode(file.getvalue()).decode()
    return f'<img alt="{_text(result._title())}" src="data:image/png;base64,{data}">'
