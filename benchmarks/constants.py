"""All constants of the package by name, value and meaning, as a page of the documentation: docs/constants.md.

    python benchmarks/constants.py > docs/constants.md

Read from the sources: numbers that a module gives a name in capitals, and the text below them.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parent.parent / "jaxmotor"
FOLDERS = {
    "recording": "Reading and checking recordings",
    "motor": "Motors and effects",
    "prediction": "Predicted readings and their noise",
    "estimate": "Gain and pole",
    "validation": "Validation",
    "control": "Control design",
    "diagnosis": "Diagnosis",
    "fleet": "Many motors",
}
"""Those whose numbers decide what is estimated and said."""
INTRO = """# Constants

Every number that has a name at the head of a module, in the parts of the package which estimate, judge and design,
with its value and what it is. The page is made from the sources by `benchmarks/constants.py`; a test holds it up to
date.

What a diagnosis says depends most on those of four modules. `diagnosis/_certainty.py`: how sure a name is where
something stays unexplained, by [regression](other-world.md#how-sure-a-name-may-be). `diagnosis/_found.py`: what counts
as explained. `diagnosis/_evidence.py`: how models are compared. `diagnosis/_relations.py`: what an effect costs before
the recording is seen. The first are calibrated by a script, the other three were chosen and are tested by the
[blind tests](blind-tests.md) and the [other world](other-world.md). How they work together is in
[Diagnosis](diagnosis.md#how-it-works).
"""
NAME = re.compile(r"[A-Z][A-Z0-9]+(_[A-Za-z0-9]+)*$")
"""In capitals, but for a unit at its end."""


class Constant(NamedTuple):
    """One line of a module, which may give several numbers a name."""

    module: str
    names: str
    value: str
    meaning: str


def constants(folder: str) -> Iterator[Constant]:
    """Those of the modules of a `folder` of the package, module by module."""
    for path in sorted((PACKAGE / folder).rglob("*.py")):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for statement, after in zip(body, [*body[1:], None], strict=True):
            names, value = _named(statement)
            if names and value is not None and _is_number(value):
                yield Constant(path.relative_to(PACKAGE).as_posix(), ", ".join(names), ast.unparse(value), _text(after))


def _named(statement: ast.stmt) -> tuple[list[str], ast.expr | None]:
    match statement:
        case ast.Assign(targets=[target], value=value):
            nodes = target.elts if isinstance(target, ast.Tuple) else [target]
        case ast.AnnAssign(target=target, value=value):
            nodes = [target]
        case _:
            return [], None
    names = [node.id for node in nodes if isinstance(node, ast.Name)]
    return (names if all(map(NAME.match, names)) else []), value


def _is_number(value: ast.expr) -> bool:
    """Made of numbers alone: by arithmetic, by functions of NumPy or `math`, or two of a `Logistic`."""
    match value:
        case ast.Constant(value=one):
            return isinstance(one, int | float) and not isinstance(one, bool)
        case ast.UnaryOp(operand=one):
            return _is_number(one)
        case ast.BinOp(left=one, right=other):
            return _is_number(one) and _is_number(other)
        case ast.Tuple(elts=several) | ast.List(elts=several):
            return bool(several) and all(map(_is_number, several))
        case ast.Call(func=function, args=several):
            return ast.unparse(function).startswith(("np.", "math.", "Logistic")) and all(map(_is_number, several))
        case ast.Attribute():
            return ast.unparse(value).startswith(("np.", "math."))
    return False


def _text(statement: ast.stmt | None) -> str:
    match statement:
        case ast.Expr(value=ast.Constant(value=str(text))):
            return " ".join(text.split())
    return ""


def page() -> str:
    """In Markdown."""
    lines = [INTRO]
    for folder, title in FOLDERS.items():
        lines += [f"## {title}\n", "| constant | value | what it is | module |", "|---|---|---|---|"]
        for one in constants(folder):
            value, meaning = (text.replace("|", "\\|") for text in (one.value, one.meaning))
            lines.append(f"| `{one.names}` | `{value}` | {meaning} | `{one.module}` |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    print(page(), end="")
