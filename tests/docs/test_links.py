"""Links between pages lead somewhere."""

import re

import pytest
from pages import DOCS, PAGES, ROOT, name

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def slug(heading: str) -> str:
    """As GitHub and the site make it from a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def prose(page) -> str:
    return re.sub(r"^```.*?^```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def anchors(page) -> set[str]:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return {slug(heading.replace("`", "")) for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_leads_somewhere(page):
    for link in LINK.findall(prose(page)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{link}: no such file"
        assert not anchor or anchor in anchors(target), f"{link}: no such heading"


@pytest.mark.parametrize("folder", ["", "effects", "notebooks", "api"])
def test_each_index_lists_its_pages(folder):
    index = DOCS / folder / "index.md"
    listed = {(index.parent / link.partition("#")[0]).resolve() for link in LINK.findall(index.read_text("utf-8"))}
    pages = {*index.parent.glob("*.md"), *(DOCS.glob("*/index.md") if not folder else ())}
    assert pages - {index} <= listed


def test_every_picture_is_shown_somewhere():
    shown = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    missing = [path.relative_to(DOCS) for path in (DOCS / "img").rglob("*.*") if path.name not in shown]
    assert not missing


def test_pages_that_are_written_as_plain_names_exist():
    """`docs/wiring.md` and the like, in prose and in the code's comments."""
    sources = [*PAGES, *(ROOT / "jaxmotor").rglob("*.py"), *(ROOT / "firmware").rglob("*.[ch]")]
    for source in sources:
        for path in re.findall(r"\b((?:docs|tests|benchmarks)/[\w/]+\.(?:md|py))\b", source.read_text("utf-8")):
            assert (ROOT / path).exists(), f"{name(source)} names {path}"
