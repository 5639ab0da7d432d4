"""docs/paper.md is what its script writes today."""

import re
import shutil
import subprocess

import pytest
from pages import DOCS, ROOT

NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?")


@pytest.fixture(scope="module")
def written():
    if not all(map(shutil.which, ("make", "cc"))):
        pytest.skip("the plant library needs a C compiler; apt install build-essential")
    subprocess.run(["make", "-s", "-C", ROOT / "firmware", "plant"], check=True, capture_output=True)
    import paper

    found = paper.find()
    return paper.PAGE.read_text(encoding="utf-8").format_map(paper.values(found))


def test_the_page_is_up_to_date(written):
    page = (DOCS / "paper.md").read_text(encoding="utf-8")
    assert NUMBER.sub("#", page) == NUMBER.sub("#", written), "run benchmarks/paper.py"
    for shown, now in zip(map(float, NUMBER.findall(page)), map(float, NUMBER.findall(written)), strict=True):
        assert shown == pytest.approx(now, rel=0.03, abs=0.06), "run benchmarks/paper.py"


def test_the_page_says_what_the_paper_said(written):
    """Figures of the paper that can be read with certainty."""
    assert "| 5 | 19.4 |" in written
    assert "= 0.0366" in written
    for figure in ("Table 1", "Table 2", *(f"Fig. {n}" for n in range(2, 13)), "eq. 21", "Eq. 20"):
        assert figure in written, figure
    for row in ("| resistance of the winding R | 4.5 ohm |", "| inductance of the winding L | 524 µH |"):
        assert row in written, row


def test_each_picture_has_a_caption():
    """In italics under it; those of the paper's figures have the paper's number."""
    page = (DOCS / "paper.md").read_text(encoding="utf-8")
    shown = re.findall(r"^!\[(.+)\]\((\S+)\)\n\n\*(.+)\*$", page, re.MULTILINE)
    assert len(shown) == page.count("![")
    for _, path, caption in shown:
        number = re.search(r"/fig-(\d+)\.", path)
        assert number is None or caption.startswith(f"Fig. {number[1]}. "), path


def test_gains_are_in_the_papers_unit_too(written):
    value = r"\| (\d+\.\d+)(?: ± \S+)? "
    found = re.findall(rf"^\|.* {value}{value}\| [+-]\S+ % \|", written, re.MULTILINE)
    assert len(found) == 4
    for gain, in_rpm in found:
        assert float(in_rpm) == pytest.approx(float(gain) * 9.5493, rel=6e-4)
