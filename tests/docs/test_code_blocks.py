"""Code on the pages: commands are ones that exist, plans can be run, Python runs."""

import ast
import re
import shlex
import shutil

import numpy as np
import pytest
import typer
from pages import DOCS, PAGES, ROOT, blocks, commands, name

from jaxmotor.bench import parse_plan
from jaxmotor.cli._main import build
from jaxmotor.recording import read, write

BUNDLED = ROOT / "jaxmotor" / "recording" / "bundled"
APPLICATION = typer.main.get_command(build())
NOT_HERE = {
    "docs/control.md": "tests/present/exports/test_pages.py runs it",
    "docs/export.md": "tests/present/exports/test_pages.py runs it",
    "docs/effects/index.md": "names the parts, not a whole example",
    "docs/recording.md": "needs a board",
    "docs/fleet.md": "needs a fleet and its results; tests/fleet has both",
    **{name(page): "tests/docs/test_notebooks.py runs it" for page in PAGES if page.parent.name == "notebooks"},
}
PYTHON = [page for page in PAGES if any(block.language == "python" for block in blocks(page))]


def is_synopsis(command: str) -> bool:
    """Brackets, bars and dots say what may stand there."""
    return bool(re.search(r"[\[\]()|]|\.\.\.", command))


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=name)
def test_commands_are_ones_that_exist(page):
    for line in commands(page):
        _, sub, *arguments = shlex.split(line)
        if sub.startswith("--"):
            continue
        assert sub in APPLICATION.commands, line
        command = APPLICATION.commands[sub]
        options = {option for parameter in command.params for option in (*parameter.opts, "--help")}
        assert set(re.findall(r"(?<=[ \[(|])--?[a-z][a-z-]*", line)) <= options, line
        if not is_synopsis(line):
            context = command.context_class(command)
            given, rest, _ = command.make_parser(context).parse_args(arguments)
            assert not rest, f"{line}: {rest} is too much"
            needed = [parameter.name for parameter in command.params if parameter.required]
            assert not [parameter for parameter in needed if given.get(parameter) is None], line


def test_plans_can_be_run():
    written = [(page, block) for page in PAGES for block in blocks(page) if block.language != "python"]
    plans = [(page, block) for page, block in written if "[[experiment]]" in block.text]
    assert len(plans) >= 2
    for page, block in plans:
        assert parse_plan(block.text, name(page)).ticks > 100


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """What the examples find beside them."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(BUNDLED / "paper.csv", "motor.csv")
    shutil.copy(BUNDLED / "paper.csv", "m1.csv")
    volts, speed = np.random.default_rng(0).choice([-1.5, 1.5], 400), 0.0
    rows = ["t_s,u_V,y_deg_per_s"]
    for k, u in enumerate(np.repeat(volts, 5)):
        speed += 0.3 * (170 * u - speed)
        rows.append(f"{0.02 * k:.2f},{u},{speed:.4f}")
    (tmp_path / "prbs_open.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "results").mkdir()
    return tmp_path


@pytest.fixture
def model(folder):
    """`results/motor.json`, as the first page of the tutorial leaves it."""
    from jaxmotor.cli import main

    assert main(["identify", "motor.csv", "--hold-out", "step,closed_loop", "-o", "results"]) == 0


@pytest.mark.parametrize("page", [page for page in PYTHON if name(page) not in NOT_HERE], ids=name)
def test_python_runs(page, folder, request):
    code = [block.text for block in blocks(page) if block.language == "python"]
    if any("results/motor.json" in text for text in code):
        request.getfixturevalue("model")
    scope: dict = {}
    for text in code:
        exec(compile(text, name(page), "exec"), scope)
    assert set(scope) > {"__builtins__"}


@pytest.mark.parametrize("page", PYTHON, ids=name)
def test_python_is_python(page):
    for block in blocks(page):
        assert block.language != "python" or ast.parse(block.text, name(page)).body


def test_what_is_not_run_here_is_there():
    assert set(NOT_HERE) - {"docs/notebooks/index.md"} <= {name(page) for page in PYTHON}


def test_the_recording_on_its_page_can_be_read(folder):
    """The format's example, with rows for its second segment."""
    [text] = [b.text for b in blocks(DOCS / "recording-format.md") if b.text.startswith("# jaxmotor recording 1")]
    (folder / "example.csv").write_text(text)
    recording = read(folder / "example.csv")
    assert [segment.kind for segment in recording.segments] == ["sine", "step"]
    write(recording, folder / "again.csv")
