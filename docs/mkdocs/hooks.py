"""What GitHub shows and the site would not: bars in tables' code, and links to files outside the documentation."""

import posixpath
import re
from typing import Any

LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#:]+)(?:#[^)]*)?\)")


def on_page_markdown(markdown: str, *, page: Any, **_: object) -> str:
    """The page's text as the site's Markdown wants it."""
    folder = posixpath.dirname(page.file.src_uri)
    lines = [_row(line) if line.startswith("|") else line for line in markdown.split("\n")]
    return LINK.sub(lambda link: _text(link, folder), "\n".join(lines))


def _row(line: str) -> str:
    """In a code span `\\|` is a bar, not a backslash and a bar."""
    return re.sub(r"`[^`]*`", lambda span: span[0].replace("\\|", "|"), line)


def _text(link: re.Match[str], folder: str) -> str:
    """Of a link that leaves the documentation only its text stays."""
    outside = posixpath.normpath(posixpath.join(folder, link[2])).startswith("..")
    return link[1] if outside else link[0]
