"""The pages, and what stands in them."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "firmware").rglob("*.md")),
    *sorted(DOCS.rglob("*.md")),
]


class Block(NamedTuple):
    """A piece of code on a page."""

    language: str
    """Empty where none is stated."""
    text: str


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path) -> list[Block]:
    """Fenced ones, and those indented by four blanks after an empty line."""
    text = page.read_text(encoding="utf-8")
    fenced = [Block(*found) for found in re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)]
    rest = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    indented = re.findall(r"(?<=\n\n)(?:(?: {4}.*)?\n)+", rest)
    pieces = [re.sub(r"^ {4}", "", piece, flags=re.MULTILINE).strip("\n") for piece in indented]
    return fenced + [Block("", piece) for piece in pieces if piece]


def commands(page: Path) -> list[str]:
    """Lines of code that run `jaxmotor`, comments left out, continued lines joined."""
    found = []
    for block in blocks(page):
        text = re.sub(r"\\?\n {4,}(?=[\[(-])", " ", block.text)
        for line in text.splitlines():
            if line.startswith("jaxmotor ") and block.language in ("", "bash"):
                found.append(re.split(r"\s+#|\s+;\s+|\s+\|\s+", line)[0].strip())
    return found
