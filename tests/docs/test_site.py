"""The documentation as a site."""

import importlib
import importlib.util
import os
import re
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser

import pytest
from fontTools import ttLib
from opened import Watched
from pages import DOCS, ROOT, blocks

import jaxmotor

CONFIGURATION = DOCS / "mkdocs" / "mkdocs.yml"
PACKAGES = ("mkdocs", "material", "mkdocstrings", "math_core")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    missing = [name for name in PACKAGES if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"the site cannot be built without {', '.join(missing)}; pip install -e '.[docs]'")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", CONFIGURATION, "-d", folder]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, capture_output=True, text=True, check=False, env=quiet)
    assert built.returncode == 0 and "WARNING" not in built.stderr, built.stdout + built.stderr
    return folder


class Fetched(HTMLParser):
    """What a browser would fetch to show the page."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload", "preconnect", "modulepreload"):
            self.addresses.append(given.get("href") or "")
        elif tag in ("script", "img", "iframe", "source", "video", "audio", "object", "embed"):
            self.addresses.append(given.get("src") or given.get("data") or "")


def test_pages_fetch_nothing_from_elsewhere(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > 50
    for page in pages:
        fetched = Fetched()
        fetched.feed(page.read_text(encoding="utf-8"))
        assert fetched.addresses
        for address in filter(None, fetched.addresses):
            assert not re.match(r"[a-z]+:|//", address) or address.startswith("data:"), (page.name, address)


def test_styles_fetch_nothing_from_elsewhere(site):
    for style in site.rglob("*.css"):
        addresses = re.findall(r"url\(['\"]?([^)'\"]+)", style.read_text(encoding="utf-8"))
        assert not [address for address in addresses if re.match(r"https?:|//", address)], style


def test_the_public_names_are_documented(site):
    """`import jaxmotor` offers nothing that the pages about Python leave out."""
    text = "".join(page.read_text() for page in (DOCS / "api").glob("*.md"))
    for name, home in jaxmotor._HOME.items():
        assert f"::: jaxmotor.{home}.{name}\n" in text, name
    built = (site / "api" / "estimate.html").read_text()
    assert "hold_out" in built and "Of the gain" not in built
    assert 'id="jaxmotor.estimate.Fit.motor"' in built


def test_what_is_documented_exists():
    for page in (DOCS / "api").glob("*.md"):
        for path in re.findall(r"^::: (\S+)$", page.read_text(), re.MULTILINE):
            module, _, name = path.rpartition(".")
            assert hasattr(importlib.import_module(module), name), path


def test_a_bar_in_a_table_is_a_bar(site):
    assert "\\|" not in (site / "command-line.html").read_text()
    assert "brake|coast" in (site / "command-line.html").read_text()


def test_links_that_leave_the_documentation_are_text(site):
    assert (ROOT / "benchmarks").exists()
    leaving = re.compile(r'href="(?:\.\./)+(?:benchmarks|tests|firmware)/')
    assert not [page for page in site.rglob("*.html") if leaving.search(page.read_text(encoding="utf-8"))]


def test_every_formula_is_drawn(site):
    pages = [page for page in DOCS.rglob("*.md") if any(block.language == "math" for block in blocks(page))]
    assert len(pages) > 30
    for page in pages:
        html = (site / page.relative_to(DOCS).with_suffix(".html")).read_text(encoding="utf-8")
        wanted = sum(block.language == "math" for block in blocks(page))
        assert html.count('<math display="block">') == wanted, page
        assert html.count("<math") == html.count('class="arithmatex"'), page


def test_the_font_has_every_sign_of_the_formulas(site):
    font = ttLib.TTFont(next(site.rglob("STIXTwoMath-subset.woff")))
    formulas = re.findall(
        r"<math.*?</math>", "".join(page.read_text("utf-8") for page in site.rglob("*.html")), re.DOTALL
    )
    signs = set(unescape(re.sub(r"<[^>]*>", "", "".join(formulas))))
    assert len(signs) > 60 and not {sign for sign in signs if ord(sign) not in font.getBestCmap()} - {"\n"}
    assert "MATH" in font


@pytest.fixture(params=["light", "dark"])
def opened(request, site, browser):
    """The first page, opened from disk; it and the pages that follow send for nothing but files beside them."""
    watched = Watched(browser, site / "index.html", color_scheme=request.param)
    yield watched
    assert watched.wrong == []
    assert all(address.startswith(site.as_uri()) for address in watched.requests)
    watched.context.close()


def test_search_finds_a_page_from_disk(opened):
    opened.page.locator("input.md-search__input").click()
    opened.page.keyboard.type("coulomb")
    found = opened.page.locator("a.md-search-result__link[href*='effects/coulomb_friction.html']").first
    found.wait_for(timeout=20_000)
    found.click()
    assert opened.page.locator("h1").inner_text().startswith("Coulomb friction (coulomb_friction)")


def test_formulas_have_a_size_and_fit_a_telephone(site, opened):
    opened.page.set_viewport_size({"width": 360, "height": 800})
    for path in ("effects/coulomb_friction", "effects/backlash", "paper", "identification", "diagnosis"):
        opened.page.goto((site / f"{path}.html").as_uri())
        boxes = [formula.bounding_box() for formula in opened.page.locator("div.arithmatex math").all()]
        assert boxes and all(box["width"] > 20 and box["height"] > 10 for box in boxes), path
        # The page is as wide as the window: what is wider scrolls by itself.
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= 360, path
        fonts = opened.page.evaluate("document.fonts.ready.then(fonts => [...fonts].map(font => font.status))")
        assert fonts == ["loaded"], path
