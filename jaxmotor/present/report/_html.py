"""HTML that cannot be broken out of: whatever is not `Html` already is text, and is escaped when it is put in.

Elements are made by `element`, so every one is closed, and a string from a recording can neither become markup nor
leave its attribute. Characters that HTML does not have, and those that turn the direction of writing, become �.
"""

import html
import json
import math
import re
from collections.abc import Iterable
from typing import Any

from jaxmotor._json import plain

VOID = frozenset({"meta", "br", "hr", "path", "line", "rect", "circle"})
"""Elements without content. SVG's own are closed in place."""
# Controls, lone surrogates, and what turns the direction of writing.
STRANGE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\u200e\u200f\u202a-\u202e\u2066-\u2069\ufffe\uffff]")


class Html(str):
    """Markup, safe to put into a page as it stands."""


Content = str | Html | Iterable[Any] | None


def escaped(content: Content) -> Html:
    """`content` as markup: `Html` as it is, other strings as text, and what is iterable one after the other."""
    if content is None:
        return Html()
    if isinstance(content, Html):
        return content
    if isinstance(content, str):
        return Html(html.escape(_known(content)))
    return Html("".join(escaped(one) for one in content))


def element(name: str, /, *content: Content, **attributes: str | float | int | bool | None) -> Html:
    """`<name attribute="...">content</name>`. A `_` in an attribute's name is a hyphen, but at its end nothing.

    Attributes that are None or False are left out; those that are True have no value.
    """
    given = "".join(_attribute(key, value) for key, value in attributes.items())
    if name in VOID:
        assert not content, f"<{name}> has no content"
        return Html(f"<{name}{given}/>")
    return Html(f"<{name}{given}>{escaped(content)}</{name}>")


def _attribute(name: str, value: str | float | int | bool | None) -> str:
    if value is None or value is False:
        return ""
    name = name.rstrip("_").replace("_", "-")
    return f" {name}" if value is True else f' {name}="{escaped(str(value))}"'


def data_block(content: Any, **attributes: str) -> Html:
    """`content` as JSON for the page's script: never run, and never able to end its element."""
    text = json.dumps(plain(content, _known), separators=(",", ":"), allow_nan=False)
    for char in "<>&":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return element("script", Html(text), type="application/json", **attributes)


def _known(text: str) -> str:
    """`text` without what HTML does not have."""
    return STRANGE.sub("\N{REPLACEMENT CHARACTER}", text)


def paragraph(*content: Content, **attributes: str) -> Html:
    return element("p", *content, **attributes)


def bullets(items: Iterable[Content]) -> Html:
    """A list, or nothing where there are no items."""
    rows = [element("li", item) for item in items]
    return element("ul", rows) if rows else Html()


def details(summary: str, *content: Content, printed: bool = True) -> Html:
    """What is a click away on a screen; on paper it is there at once, or, not `printed`, not at all."""
    return element("details", element("summary", summary), *content, class_=None if printed else "screen")


def number(value: float, key: str, shown: str) -> Html:
    """`shown`, with the whole number and what it is called for programs."""
    exact = repr(float(value)) if math.isfinite(value) else ""
    return element("data", shown, value=exact, data_key=key)


def unbroken(text: str) -> Html:
    """`text` on one line, however narrow its column is."""
    return element("span", text, class_="word")


def table(caption: str, head: Iterable[Content], rows: Iterable[Iterable[Content]], **attributes: str) -> Html:
    """A table whose first column names its rows."""
    columns = element("tr", [element("th", cell, scope="col") if cell else element("td") for cell in head])
    body = [_row(list(row)) for row in rows]
    title = element("caption", element("span", caption))
    whole = element("table", title, element("thead", columns), element("tbody", body), **attributes)
    # Wide tables scroll by themselves; who has no mouse must reach them, too.
    return element("div", whole, class_="wide", tabindex="0", role="region", aria_label=caption)


def _row(cells: list[Content]) -> Html:
    return element("tr", element("th", cells[0], scope="row"), [element("td", cell) for cell in cells[1:]])


def bar(share: float, style: str) -> Html:
    """A bar of `share` [1] of its column's width."""
    rect = element("rect", width=f"{100 * min(max(share, 0.0), 1.0):.1f}", height=10, class_=f"bar {style}")
    return element("svg", rect, viewBox="0 0 100 10", preserveAspectRatio="none", class_="share", aria_hidden="true")
