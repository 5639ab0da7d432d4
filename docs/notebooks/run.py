"""Runs a page of this folder as a notebook: cell by cell, showing what the last line of each is.

    python docs/notebooks/run.py docs/notebooks/diagnose.md [-o DIR] [--update]

Cells are the page's blocks of Python. Figures become DIR/PAGE-1.png, DIR/PAGE-2.png, ...; --update writes the answers
into the page, below their cells. Files that cells write go into the folder where this is run.
"""

import argparse
import ast
import contextlib
import io
import re
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

CELL = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)


class Cell(NamedTuple):
    """A cell, and what the page shows of its answer."""

    code: str
    shown: str


class Answer(NamedTuple):
    """What a cell printed and what its last line is, and the figure if that is one."""

    text: str
    figure: Figure | None


def cells(page: Path) -> list[Cell]:
    """The cells of a page, in order."""
    return [Cell(code, shown or "") for code, shown in CELL.findall(page.read_text(encoding="utf-8"))]


def run(page: Path) -> list[Answer]:
    """The answers of the page's cells, which share their names."""
    scope: dict[str, Any] = {}
    return [_answer(cell.code, page.name, scope) for cell in cells(page)]


def _answer(code: str, name: str, scope: dict[str, Any]) -> Answer:
    tree = ast.parse(code)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, name, "exec"), scope)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), name, "eval"), scope)
    if isinstance(value, Figure):
        return Answer(printed.getvalue(), value)
    return Answer(printed.getvalue() + ("" if value is None else f"{value!r}\n"), None)


def updated(page: Path, answers: list[Answer]) -> str:
    """The page's text with these `answers` below its cells."""
    left = iter(answers)

    def cell(match: re.Match[str]) -> str:
        text = next(left).text
        return f"```python\n{match[1]}```\n" + (f"\n```text\n{text}```\n" if text else "")

    return CELL.sub(cell, page.read_text(encoding="utf-8"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=Path)
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="where figures go")
    parser.add_argument("--update", action="store_true", help="write the answers into the page")
    options = parser.parse_args()
    answers = run(options.page)
    for cell, answer in zip(cells(options.page), answers, strict=True):
        print(*(f">>> {line}" for line in cell.code.splitlines()), sep="\n")
        print(answer.text)
    if options.output is not None:
        options.output.mkdir(parents=True, exist_ok=True)
        drawn = [answer.figure for answer in answers if answer.figure is not None]
        for number, figure in enumerate(drawn, 1):
            figure.savefig(options.output / f"{options.page.stem}-{number}.png", dpi=75)
    if options.update:
        options.page.write_text(updated(options.page, answers), encoding="utf-8")


if __name__ == "__main__":
    main()
