"""The pages in a browser: no errors, no requests, nothing runs that a recording brought along."""

import pytest
from opened import Watched
from report_pages import HOSTILE
from test_report_fleet import diagnosed_rows, rows

from jaxmotor.fleet._table import write_rows
from jaxmotor.present.report import write_fleet_page


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fleet")
    write_rows(rows(True), folder / "r.parquet", {})
    return write_fleet_page(folder / "r.parquet", folder)


@pytest.fixture(params=["light", "dark"])
def watched(request, browser, fleet):
    opened = Watched(browser, fleet, color_scheme=request.param)
    yield opened
    assert opened.wrong == [] and opened.requests == [fleet.as_uri()]
    opened.context.close()


def test_fits_any_width(watched):
    assert watched.page.get_by_text(HOSTILE, exact=True).count() == 2
    # At any width nothing is wider than the window but what scrolls by itself.
    for width in (1000, 360):
        watched.page.set_viewport_size({"width": width, "height": 900})
        assert watched.page.evaluate("document.documentElement.scrollWidth") <= width


def test_hover_shows_the_motor_that_is_pointed_at(watched):
    found = watched.page.evaluate("JSON.parse(document.querySelector('script.hover').textContent)")
    odd = found[0]["series"][1]
    drawing = watched.page.locator("svg.plot").first
    width, height = map(float, drawing.get_attribute("viewBox").split()[2:])
    text = watched.point_at(0, odd["x"][0] / width, odd["y"][0] / height)
    assert "do not belong 90" in text and "one" in text


def test_keys_walk_along_a_plot(watched):
    drawing = watched.page.locator("svg.plot").first
    drawing.focus()
    seen = set()
    for _ in range(5):
        watched.page.keyboard.press("ArrowRight")
        seen.add(watched.page.locator(".tip").first.inner_text())
    assert len(seen) >= 4
    watched.page.keyboard.press("Escape")
    assert watched.page.locator(".tip:visible").count() == 0


def test_a_column_sorts_and_what_is_not_known_stands_last(watched):
    button = watched.page.get_by_role("button", name="pole (rad/s)")
    values = "[...document.querySelectorAll('data[data-key=pole_rad_s]')].map((one) => +one.value)"
    button.click()
    assert (up := watched.page.evaluate(values)) == sorted(up)
    button.click()
    assert watched.page.evaluate(values) == sorted(up, reverse=True)
    head = watched.page.locator("th[aria-sort]")
    assert head.count() == 1 and head.get_attribute("aria-sort") == "descending"


def test_a_diagnosed_fleet_sorts_by_cause_and_fits_a_telephone(browser, tmp_path):
    write_rows(diagnosed_rows(), tmp_path / "r.parquet", {})
    opened = Watched(browser, write_fleet_page(tmp_path / "r.parquet", tmp_path))
    button = opened.page.get_by_role("button", name="effects")
    button.click()
    cells = opened.page.evaluate(
        "[...document.querySelectorAll('#motors ~ div tbody tr')].map((one) => one.lastChild.textContent)"
    )
    named = [cell for cell in cells if cell]
    assert len(cells) == 39 and cells == named + [""] * (39 - len(named)) and named[0].startswith("a law <b>")
    opened.page.set_viewport_size({"width": 360, "height": 900})
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 360
    assert opened.wrong == []
    opened.context.close()


def test_prints_on_white(browser, fleet):
    opened = Watched(browser, fleet, color_scheme="dark")
    opened.page.emulate_media(media="print", color_scheme="dark")
    assert opened.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert opened.page.evaluate("getComputedStyle(document.body).color") == "rgb(0, 0, 0)"
    assert opened.page.pdf()[:5] == b"%PDF-"
    assert opened.wrong == []
    opened.context.close()
