"""One page: a single file that needs nothing else, and that lets nothing in or out.

The policy in its head allows no request at all, and no script but the page's own, by its hash.
"""

import base64
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from jaxmotor.present.report._html import Content, Html, element, paragraph

FOLDER = Path(__file__).parent


class Section(NamedTuple):
    """A chapter of the page."""

    name: str
    """Where links point; a word."""
    title: str
    content: Content


def page(title: str, lead: Content, sections: Sequence[Section]) -> str:
    """The whole page as text. Sections without content are left out."""
    chapters = [section for section in sections if section.content]
    script = (FOLDER / "page.js").read_text(encoding="utf-8")
    style = (FOLDER / "page.css").read_text(encoding="utf-8")
    head = [
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=_policy(script)),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="generator", content="jaxmotor"),
        element("title", title),
        element("style", Html(style)),
    ]
    links = [element("li", element("a", one.title, href=f"#{one.name}")) for one in chapters]
    body = [
        element("a", "Skip to the findings", href="#findings", class_="skip"),
        element("header", element("h1", title), lead),
        element("nav", element("ol", links), aria_label="Contents"),
        element("main", [_chapter(one) for one in chapters], id="findings"),
        element("footer", paragraph("Made by jaxmotor. This page holds all it needs.", class_="quiet")),
        element("script", Html(script)),
    ]
    html = element("html", element("head", head), element("body", body), lang="en")
    return f"<!DOCTYPE html>\n{html}\n"


def _chapter(section: Section) -> Html:
    title = element("h2", section.title, id=section.name)
    return element("section", title, section.content, aria_labelledby=section.name)


def _policy(script: str) -> str:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; base-uri 'none'"


def figure(drawing: Content, caption: Content) -> Html:
    """A drawing with its caption below, and a button that saves what it shows."""
    button = element("button", "Save as CSV", type="button", class_="csv")
    return element("figure", drawing, element("figcaption", caption, " ", button))


def runs(blocks: Sequence[Content]) -> Content:
    """Blocks below each other; on paper two beside each other."""
    return element("div", blocks, class_="runs") if blocks else None


def cards(entries: Iterable[tuple[str, Content]]) -> Html:
    """Few numbers that are looked for first."""
    pairs = [element("div", element("dt", name), element("dd", value)) for name, value in entries]
    return element("dl", pairs, class_="cards")
