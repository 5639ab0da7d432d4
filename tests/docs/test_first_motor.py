"""The first ten minutes: every command of docs/first-motor.md, in order, and what the page shows of its answer."""

import shlex
import subprocess

import pytest
from pages import DOCS, ROOT, blocks, name

from jaxmotor.bench._emulator import PACKAGES, find_or_build, missing_tools
from jaxmotor.cli import main

PAGE = DOCS / "first-motor.md"
ESTIMATES = ("gain", "pole", "offset")
"""What lines begin with whose last digits may differ between processors."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """With the emulated bench built."""
    if missing := missing_tools():
        pytest.skip(f"emulated bench: no {', '.join(missing)}; apt install {PACKAGES}")
    find_or_build()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_commands_of_the_page(folder, capsys):
    answers = 0
    said = ""
    for block in blocks(PAGE):
        if block.language == "bash":
            said = "".join(run(line, capsys) for line in block.text.splitlines())
        elif block.language == "text":
            answers += 1
            for shown in block.text.splitlines():
                assert is_said(shown, said), f"{name(PAGE)}: {shown}"
    assert answers >= 5
    assert {"results", "motor.h", "simulated.csv"} <= {path.name for path in folder.iterdir()}


def test_the_commands_of_the_first_page_to_read(folder, capsys):
    """README's, but for those that install."""
    [block] = [block.text for block in blocks(ROOT / "README.md") if block.language == "bash"]
    lines = block.splitlines()
    assert lines[1:3] == ["make demo", ". .venv/bin/activate"] and set(PACKAGES.split()) <= set(lines[0].split())
    said = "".join(run(line, capsys) for line in lines[3:])
    assert "coulomb_friction: dry friction takes" in said
    assert {"motor.json", "motor-extended.json", "motor.html"} <= {path.name for path in (folder / "results").iterdir()}


def run(line: str, capsys) -> str:
    """What the command says."""
    if not line.startswith("jaxmotor "):
        return subprocess.run(line, shell=True, check=True, capture_output=True, text=True).stdout
    code = main(shlex.split(line)[1:])
    said = capsys.readouterr()
    assert code == 0, f"{line}\n{said.err}"
    return said.out + said.err


def is_said(shown: str, said: str) -> bool:
    """The line was printed; of a cause its name, which may stand among the ones that look the same."""
    words = shown.split()
    if words[0] == "why":
        return words[1].rstrip(":") in said
    return shortened(shown) in map(shortened, said.splitlines())


def shortened(line: str) -> str:
    """All of a line, but of estimates only their first two digits."""
    words = line.split()
    return f"{words[0]} {float(words[1]):.2g}" if words and words[0] in ESTIMATES else " ".join(words)
