"""The pages in a browser: no errors, no requests, nothing runs that a recording brought along."""

import re
import shutil
import subprocess
import unicodedata

import pytest
from opened import Watched
from report_pages import HOSTILE, Page
from test_report import told as told
from test_report_fleet import diagnosed_rows, rows

from jaxmotor.fleet._table import write_rows
from jaxmotor.present.report import write_fleet_page
from jaxmotor.text import RPM, with_error

SENTENCE = "This is a linear motor with Coulomb friction; that explains all that the recording shows."


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


def speed_per_volt(story):
    gain, error = float(story.diagnosis.motor.linear.gain), story.diagnosis.standard_error["gain_rad_s_V"]
    return with_error(RPM * gain, RPM * error, "rpm/V")


@pytest.mark.parametrize(
    ("width", "height", "scheme", "paper"),
    [
        (1280, 900, "light", "rgb(255, 255, 255)"),
        (360, 740, "light", "rgb(255, 255, 255)"),
        (1280, 900, "dark", "rgb(21, 24, 27)"),
    ],
    ids=["desktop", "phone", "dark"],
)
def test_the_first_screen_holds_name_sentence_and_speed(browser, told, width, height, scheme, paper):
    opened = Watched(browser, told[2], color_scheme=scheme)
    page = opened.page
    page.set_viewport_size({"width": width, "height": height})
    for place, wanted in (
        ("h1", HOSTILE),
        (".verdict p", SENTENCE),
        (".cards dt", "speed per volt"),
        (".cards dd", speed_per_volt(told[0])),
    ):
        shown = page.locator(place).first
        assert wanted in shown.inner_text(), place
        box = shown.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= width, place
        assert box["y"] >= 0 and box["y"] + box["height"] <= height, place
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == paper
    assert opened.wrong == []
    opened.context.close()


def test_a_wide_table_on_a_phone_scrolls_and_its_caption_does_not(browser, told):
    opened = Watched(browser, told[2])
    opened.page.set_viewport_size({"width": 360, "height": 740})
    table = opened.page.locator(".wide", has_text="Alternatives: chi2").first
    table.scroll_into_view_if_needed()
    inside, whole = (table.evaluate(f"(one) => one.{what}") for what in ("clientWidth", "scrollWidth"))
    assert whole > inside and "gradient" in table.evaluate("(one) => getComputedStyle(one).backgroundImage")
    caption = table.locator("caption span")
    for place in (0, whole):
        table.evaluate("(one, place) => { one.scrollLeft = place; }", place)
        box = caption.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= 360
    # A model's name is not broken word by word.
    assert min(one.bounding_box()["width"] for one in table.locator("tbody th").all()) > 120
    opened.context.close()


def printed(opened, folder):
    """The words of the page on paper, with single spaces, and those of its first sheet."""
    if shutil.which("pdftotext") is None:
        pytest.skip("there is no pdftotext; apt install poppler-utils")
    opened.page.pdf(path=folder / "page.pdf", format="A4")
    done = subprocess.run(["pdftotext", folder / "page.pdf", "-"], capture_output=True, check=True)
    text = unicodedata.normalize("NFKC", done.stdout.decode())
    return " ".join(text.split()), " ".join(text.partition("\f")[0].split())


def test_paper_has_the_first_screen_and_every_heading(browser, told, tmp_path):
    opened = Watched(browser, told[2])
    words, first = printed(opened, tmp_path)
    for wanted in (HOSTILE, SENTENCE, "speed per volt", speed_per_volt(told[0]), "time constant", "How sure"):
        assert wanted in first, wanted
    text = told[2].read_text(encoding="utf-8")
    headings = re.findall(r"<(h[1-3])\b[^>]*>(.*?)</\1>", text, flags=re.S)
    assert len(headings) > 12
    for _, heading in headings:
        plain = "".join(Page(f"<p>{heading}</p>").words)
        assert " ".join(unicodedata.normalize("NFKC", plain).split()) in words, plain
    opened.context.close()


def test_runs_stand_side_by_side_on_paper_alone(browser, told):
    opened = Watched(browser, told[2])
    beside = {}
    for media in ("screen", "print"):
        opened.page.emulate_media(media=media)
        first, second = (opened.page.locator("#checks ~ .runs > .run").nth(k).bounding_box() for k in (0, 1))
        beside[media] = second["x"] >= first["x"] + first["width"] and second["y"] == first["y"]
    assert beside == {"screen": False, "print": True}
    opened.context.close()
