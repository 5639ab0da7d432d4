"""What every page must be: well formed, whole, closed to the outside, and readable without eyes or colours."""

import itertools
import json
import re
from html.parser import HTMLParser

VOID = {"meta", "br", "hr"}
HOSTILE = "<script>alert(1)</script>"
LOADS = {"img", "iframe", "object", "embed", "link", "video", "audio", "image", "use", "base", "form", "foreignobject"}
"""Elements that load something, or lead somewhere."""


class Page(HTMLParser):
    """A page taken apart; what is not well formed is an error."""

    def __init__(self, text: str):
        super().__init__(convert_charrefs=True)
        self.stack: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.data: dict[str, list[tuple[str, str]]] = {}
        self.blocks: dict[str, list[str]] = {"script": [], "style": [], "pre": []}
        self.words: list[str] = []
        self.text = text
        self.feed(text)
        self.close()
        assert not self.stack, f"left open: {self.stack}"

    def handle_starttag(self, tag, attrs):
        assert len(dict(attrs)) == len(attrs), f"<{tag}> has an attribute twice"
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.stack.append(tag)
        if tag in self.blocks:
            self.blocks[tag].append("")
        if tag == "data" and dict(attrs).get("data-key"):
            self.data.setdefault(dict(attrs)["data-key"], []).append((dict(attrs)["value"], ""))

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.stack and self.stack[-1] == tag, f"</{tag}> within {self.stack}"
        self.stack.pop()

    def handle_data(self, data):
        inside = self.stack[-1] if self.stack else ""
        if inside in self.blocks:
            self.blocks[inside][-1] += data
        if inside not in ("script", "style"):
            self.words.append(data)
        if inside == "data":
            key = next(a["data-key"] for t, a in reversed(self.elements) if t == "data") if self.elements else None
            if key in self.data:
                value, shown = self.data[key][-1]
                self.data[key][-1] = (value, shown + data)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        """Attributes of all elements of this name."""
        return [attributes for name, attributes in self.elements if name == tag]


def check_closed(page: Page) -> None:
    """Nothing is loaded, nothing leads out, and no script but the page's own can run."""
    assert not LOADS & {tag for tag, _ in page.elements}
    for tag, attributes in page.elements:
        assert not {"src", "srcset", "style", "action"} & set(attributes), tag
        assert not [name for name in attributes if name.startswith("on")], tag
        assert (attributes.get("href") or "#").startswith("#")
    [style] = page.blocks["style"]
    assert "@import" not in style and "url(" not in style
    running = [block for block in page.of("script") if block.get("type") != "application/json"]
    assert len(running) == 1
    code = page.blocks["script"][-1]
    assert not re.search(r"fetch|XMLHttp|import\b|innerHTML|eval|document\.write", code)
    policy = next(a["content"] for a in page.of("meta") if a.get("http-equiv"))
    assert "default-src 'none'" in policy and "'sha256-" in policy


def check_readable(page: Page) -> None:
    """Headings in order, names for pictures and tables, links that lead somewhere."""
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after - before <= 1 for before, after in itertools.pairwise(levels))
    for picture in page.of("svg"):
        named = picture.get("role") == "img" and len(picture.get("aria-label") or "") > 20
        assert named or picture.get("aria-hidden") == "true"
    assert len(page.of("caption")) == len(page.of("table"))
    ids = [attributes["id"] for _, attributes in page.elements if attributes.get("id")]
    assert len(ids) == len(set(ids))
    assert {link["href"][1:] for link in page.of("a")} <= set(ids)
    assert page.of("html")[0]["lang"] == "en" and page.of("main") and page.of("nav")


def hovers(page: Page) -> list[dict]:
    """Of all plots, panel by panel."""
    blocks = zip(page.of("script"), page.blocks["script"], strict=True)
    return [panel for about, text in blocks if about.get("type") == "application/json" for panel in json.loads(text)]


def contrast(first: str, second: str) -> float:
    """Of two colours (#rrggbb), as WCAG 2.1 defines it."""
    light, dark = sorted((_luminance(first), _luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
