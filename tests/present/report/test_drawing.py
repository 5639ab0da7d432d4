"""Figures in a page: the same marks as matplotlib draws, text that stays text, nothing that leads out."""

import io
import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_pages import HOSTILE, Page, hovers

from jaxmotor.present._style import BAND, BLACK, BLUE, EXACT, GREY, HATCHED, MEASURED, SMALL_DOTS, VERMILLION, plain
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._html import Html

X = np.linspace(0.0, 3.0, 40)
NAMES = ("$x$", r"$\frac{", HOSTILE, "a & b ]]> <!--", "two\u202e ways", "电机")


def figure() -> Figure:
    """All kinds of marks, and no text."""
    made = Figure(figsize=(3, 2), facecolor="none")
    ax = made.add_axes((0.05, 0.05, 0.9, 0.9))
    ax.fill_between(X, np.sin(X) - 0.5, np.sin(X) + 0.5, **BAND)
    ax.fill_between(X, np.sin(X) - 1.5, np.sin(X) - 0.8, **HATCHED)
    ax.plot(X, np.sin(X), label="solid", **EXACT)
    ax.plot(X, 0.2 * X, color=VERMILLION, linestyle=(0, (5, 1.6)), linewidth=2, label="dashed")
    ax.plot(X, np.cos(X), label="open", **MEASURED)
    ax.plot(X, np.cos(X) - 0.3, label="small", **SMALL_DOTS)
    ax.plot(X[::4], np.full(10, 1.2), "s", color=BLUE, markersize=5, markerfacecolor="white")
    ax.plot(X[::4], np.full(10, -1.0), "x", color=GREY, markersize=5)
    ax.errorbar(X[::4], np.full(10, 0.6), 0.2, 0.05, color=BLACK, linestyle="none", capsize=2, label="bars")
    ax.set(ylim=(-1.4, 1.4), xlim=(0.2, 2.8), xticks=[], yticks=[])
    return made


def parsed(svg: Html) -> Page:
    return Page(f"<p>{svg}</p>")


@pytest.mark.parametrize("name", NAMES)
def test_names_are_text_and_never_mathematics(name):
    made = Figure()
    made.add_subplot().set(title=plain(name), xticks=[], yticks=[], xlabel=plain(name))
    page = parsed(drawing(made, "one", alt="a name"))
    shown = plain(name).replace(r"\$", "$").replace("\u202e", "\N{REPLACEMENT CHARACTER}")
    assert [word for word in page.words if word.strip()] == [shown, shown]
    assert [tag for tag, _ in page.elements if tag not in ("path", "rect", "clippath")] == [
        "p", "svg", "text", "text", "script",
    ]  # fmt: skip
    assert hovers(page)[0]["x"] == shown


def test_the_same_figure_is_the_same_text_and_its_names_are_its_own():
    one, same, other = (drawing(figure(), name, alt="marks") for name in ("one", "one", "other"))
    assert one == same
    for svg, name in ((one, "one"), (other, "other")):
        ids = set(re.findall(r' id="([^"]*)"', svg))
        assert len(ids) == 2 and all(re.fullmatch(rf"{name}-\d+", found) for found in ids)
        assert set(re.findall(r"url\(#([^)]*)\)", svg)) == ids
    assert not re.search("style=|href|<use|<image|<metadata|DOCTYPE|http", one)


def test_every_mark_stands_where_its_value_is():
    made = figure()
    svg = drawing(made, "one", alt="marks")
    [panel] = hovers(parsed(svg))
    left, top, width, height = panel["box"]
    series = {one["name"]: one for one in panel["series"]}
    assert list(series) == ["bars", "solid", "dashed", "open", "small"]
    np.testing.assert_allclose(np.array(series["small"]["value"], float), np.cos(X) - 0.3, rtol=1e-4, atol=1e-5)
    x = left + width * (X - 0.2) / 2.6
    y = top + height * (1.4 - np.cos(X) + 0.3) / 2.8
    np.testing.assert_allclose(series["small"]["x"], x, atol=0.06)
    np.testing.assert_allclose(series["small"]["y"], y, atol=0.06)
    [dots] = [path for path in re.findall(r'<path d="([^"]*)"', svg) if path.count("h.01") > 1]
    drawn = np.array([[float(part) for part in place] for place in re.findall(r"M(\S+) (\S+?)h\.01", dots)])
    np.testing.assert_allclose(drawn, np.stack([x, y], axis=1), atol=0.06)
    circles = max(re.findall(r'<path d="([^"]*)"', svg), key=lambda path: path.count("a"))
    assert circles.count("M") == len(X)


def test_a_browser_draws_it_as_matplotlib_does(browser):
    image = pytest.importorskip("PIL.Image")
    made, file = figure(), io.BytesIO()
    made.savefig(file, format="png", dpi=144, facecolor="white")
    wanted = np.asarray(image.open(file).convert("RGB"), float)
    page = browser.new_page(viewport={"width": wanted.shape[1], "height": wanted.shape[0]})
    page.set_content(
        f"<style>body {{ margin: 0 }} svg {{ display: block }}</style>{drawing(figure(), 'one', alt='marks')}"
    )
    shown = np.asarray(image.open(io.BytesIO(page.screenshot())).convert("RGB"), float)
    page.close()
    assert shown.shape == wanted.shape
    ink = np.abs(wanted - 255).mean()
    assert ink > 10
    # Edges are smoothed in other ways; a mark that is missing, moved or of another colour is more than that.
    assert np.abs(shown - wanted).mean() < 0.18 * ink
    for part in np.array_split(np.abs(shown - wanted).mean(axis=2), 12, axis=1):
        assert part.mean() < 0.3 * ink
