"""The notebooks: every cell runs, and answers what the page shows."""

import importlib.util
import re

import pytest
from pages import DOCS, name

FOLDER = DOCS / "notebooks"
NOTEBOOKS = [page for page in sorted(FOLDER.glob("*.md")) if page.name != "index.md"]
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]\d+)?")


@pytest.fixture(scope="module")
def notebook():
    spec = importlib.util.spec_from_file_location("notebook_run", FOLDER / "run.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", NOTEBOOKS, ids=name)
def test_cells_answer_what_is_shown(notebook, page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cells, answers = notebook.cells(page), notebook.run(page)
    assert len(cells) >= 3
    for cell, answer in zip(cells, answers, strict=True):
        assert_alike(answer.text, cell.shown)
    drawn = [f"{page.stem}-{k}.png" for k, _ in enumerate([a for a in answers if a.figure is not None], 1)]
    assert re.findall(r"img/notebooks/([\w-]+\.png)", page.read_text(encoding="utf-8")) == drawn


def assert_alike(said: str, shown: str) -> None:
    """The same words, and numbers that differ by their last digits or a tenth: solvers differ between processors."""
    assert NUMBER.sub("#", said) == NUMBER.sub("#", shown), said
    for now, then in zip(NUMBER.findall(said), NUMBER.findall(shown), strict=True):
        last = 10.0 ** -len(then.partition(".")[2].partition("e")[0])
        assert float(now) == pytest.approx(float(then), rel=0.1, abs=2 * last if "e" not in then else None), said


def test_pages_are_updated_in_place(notebook, tmp_path):
    """An answer that has changed takes the old one's place, and a page is whole but for that."""
    page = tmp_path / "page.md"
    page.write_text(
        "Before.\n\n```python\n1 + 1\n```\n\n```text\n3\n```\n\nBetween.\n\n```python\nx = 1\n```\nAfter.\n"
    )
    text = notebook.updated(page, notebook.run(page))
    assert text == page.read_text().replace("```text\n3\n", "```text\n2\n")


def test_each_notebook_is_listed():
    index = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert len(NOTEBOOKS) == 7 and all(f"]({page.name})" in index for page in NOTEBOOKS)
