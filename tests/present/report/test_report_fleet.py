"""A fleet's results, with hostile names, as a page."""

import json
import re

import numpy as np
import pytest
from report_pages import HOSTILE, Page, check_closed, check_readable, hovers

from jaxmotor.cli import main
from jaxmotor.fleet import population, read_results
from jaxmotor.fleet._table import FRICTION_NUMBERS, NUMBERS, write_rows
from jaxmotor.present.report import fleet_page, write_fleet_page

MOTORS = 40


def rows(friction: bool) -> list[dict]:
    """Gains around 10, poles around 40; motor 7 is another kind, 11 failed, 5 has a name that bites."""
    rng, made = np.random.default_rng(0), []
    for k in range(MOTORS):
        row = dict.fromkeys((*NUMBERS, *FRICTION_NUMBERS)) | {
            "motor": f"m{k}",
            "source": "f",
            "problem": None,
            "notes": [],
        }
        row |= {"gain_rad_s_V": 10 * np.exp(0.05 * rng.normal()), "pole_rad_s": 40 * np.exp(0.04 * rng.normal())}
        row |= {
            "gain_standard_error_rad_s_V": 0.02,
            "pole_standard_error_rad_s": 0.1,
            "gain_pole_covariance_rad2_s2_V": 0.0,
        }
        row |= {"chi2_per_sample": 1.0, "fit_percent": 97.0}
        if friction:
            row |= {"coulomb_friction_V": 0.2 + 0.02 * rng.normal(), "coulomb_friction_standard_error_V": 0.002}
        made.append(row)
    made[5]["motor"], made[5]["notes"] = HOSTILE, ["</td><b>note"]
    made[7] |= {"motor": "odd\u202e one", "pole_rad_s": 90.0}
    made[11] |= dict.fromkeys((*NUMBERS, *FRICTION_NUMBERS)) | {"problem": "m11: no rows <here>; record it again"}
    return made


@pytest.fixture(scope="module", params=[False, True], ids=["linear", "friction"])
def told(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fleet")
    path = folder / "r.parquet"
    write_rows(rows(request.param), path, {"dataset": "made"})
    assert main(["report", str(path), "-o", str(folder / "out")]) == 0
    return path, Page((folder / "out" / "r.html").read_text(encoding="utf-8")), request.param


def test_is_closed_and_readable(told):
    check_closed(told[1])
    check_readable(told[1])


def test_every_motor_has_its_row(told):
    _, page, _ = told
    words = "".join(page.words)
    assert HOSTILE in page.words and "odd\N{REPLACEMENT CHARACTER} one" in page.words
    assert "m11: no rows <here>; record it again" in page.words and "</td><b>note" in words
    assert len(page.data["pole_rad_s"]) == MOTORS - 1
    assert "9.0e+01" not in words and "90.00" in words.replace("90.0 ", "90.00 ")


def test_numbers_are_those_of_the_population(told):
    path, page, friction = told
    names = ("gain_rad_s_V", "pole_rad_s", *(("coulomb_friction_V",) if friction else ()))
    found = population(read_results(path), names)
    [(value, _)] = page.data["population.pole_rad_s"]
    assert float(value) == pytest.approx(float(np.exp(found.mean[1])), rel=1e-12)
    assert [outlier.motor for outlier in found.outliers] == ["odd\u202e one"]
    poles = [float(value) for value, _ in page.data["pole_rad_s"]]
    assert poles == pytest.approx(read_results(path)["pole_rad_s"].tolist(), rel=1e-15)
    panels = hovers(page)
    assert len(panels) == len(names) - 1
    outside = panels[0]["series"][1]
    assert len(outside["x"]) == 1 and "odd" in outside["at"][0] and outside["value"] == ["90"]


def words_of(page):
    return " ".join("".join(f" {word}" for word in page.words).split())


def test_the_first_screen_says_what_came_of_it(told):
    path, page, friction = told
    found = population(
        read_results(path), ("gain_rad_s_V", "pole_rad_s", *(("coulomb_friction_V",) if friction else ()))
    )
    gain, pole = (float(size) for size in found.sizes(found.mean)[:2])
    first = words_of(page).partition("What the motors have in common")[0]
    assert "39 of 40 motors were identified." in first and "1 does not belong with the others." in first
    assert f"turns at {60 * gain / (2 * np.pi):.4g} rpm/V" in first
    assert f"{100 * found.spread[0]:.2g} %), with a time constant of {1e3 / pole:.4g} ms" in first


def test_of_a_few_motors_nobody_knows_who_belongs(tmp_path):
    write_rows(rows(False)[:4], tmp_path / "r.parquet", {})
    words = words_of(Page(fleet_page(tmp_path / "r.parquet")))
    assert (
        "4 of 4 motors were identified. They are too few to say how they differ, or which one does not belong." in words
    )
    assert "do not belong not known" in words and "Not known: 4 motors with gain and pole are too few to tell" in words
    table = words.partition("All motors")[2].partition("All motors")[2]
    assert table.count("not known") == 4 and " yes " not in table and " no " not in table


FRICTION_V, BETWEEN, ERROR = 0.2, 0.02, 0.015
PLACES = ("median", "least", "largest", "spread")


def diagnosed_rows() -> list[dict]:
    """Motors 0 to 29 with friction, of which 0 to 4 cog, too; 30 to 35 linear; the others as they come."""
    made, rng = rows(False), np.random.default_rng(3)
    for k, row in enumerate(made):
        volts = FRICTION_V + BETWEEN * rng.normal() + ERROR * rng.normal()
        effects = {"coulomb_friction": {"volts_V": volts}} if k < 30 else {}
        if k < 5:
            effects["cogging"] = {"volts_V": 0.1 + 0.01 * k, "cycles_per_rev": 6.0, "phase_rad": 1.234567}
        errors = {
            name: dict.fromkeys(of, ERROR if name == "coulomb_friction" else None) for name, of in effects.items()
        }
        row |= {
            "verdict": "extended" if effects else "complete",
            "effects": list(effects),
            "effect_parameters": json.dumps(effects),
            "effect_standard_errors": json.dumps(errors),
        }
    made[36] |= {"verdict": "unexplained", "looks_like": f"a load from t = 41 s on {HOSTILE}"}
    made[36] |= {"effect_parameters": '{"sensor_lag": {"time_constant_s": 0.004}}', "effects": []}
    made[36] |= {"effect_probabilities": '{"sensor_lag": 0.31}'}
    made[37] |= {"effects": ["a law <b>of tomorrow"], "effect_parameters": '{"a law <b>of tomorrow": {"x": 1}}'}
    made[38] |= dict.fromkeys(("verdict", "effects", "effect_parameters", "effect_standard_errors"))
    made[38] |= {"diagnosis_problem": "m38: </td> its ticks are too few"}
    made[39] |= {"effect_parameters": "not JSON", "effects": ["dead_zone"]}
    return made


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("diagnosed")
    write_rows(diagnosed_rows(), folder / "r.parquet", {})
    return Page(write_fleet_page(folder / "r.parquet", folder).read_text(encoding="utf-8"))


def test_effects_are_counted_with_their_spread(diagnosed):
    check_closed(diagnosed)
    check_readable(diagnosed)
    words = " ".join("".join(f" {word}" for word in diagnosed.words).split())
    assert "39 motors were diagnosed" in words
    assert "verdict effects motors extended Coulomb friction 25 complete none 6" in words
    assert "extended Coulomb friction + cogging 5" in words
    volts = [json.loads(row["effect_parameters"])["coulomb_friction"]["volts_V"] for row in diagnosed_rows()[:30]]
    value = {key: float(diagnosed.data[f"effects.coulomb_friction.volts_V.{key}"][0][0]) for key in PLACES}
    assert [value["median"], value["least"], value["largest"]] == [np.median(volts), min(volts), max(volts)]
    # Without the errors' part: of so few motors it is known to a sixth.
    assert value["spread"] == pytest.approx(np.sqrt(np.var(volts, ddof=1) - ERROR**2), rel=1e-9)
    assert value["spread"] == pytest.approx(BETWEEN, rel=0.35)
    assert "Coulomb friction 30 (77 %)" in words and "Cogging 5 (13 %)" in words
    assert "phase_rad" not in words and "1.23" not in words and "6 per turn" in words


def test_each_motor_has_its_cause_and_text_stays_text(diagnosed):
    words = " ".join("".join(f" {word}" for word in diagnosed.words).split())
    volts = json.loads(diagnosed_rows()[7]["effect_parameters"])["coulomb_friction"]["volts_V"]
    told = f"Coulomb friction {1e3 * volts:.0f} ± {1.96e3 * ERROR:.0f} mV"
    assert words.count(told) == 2, "in the table of all motors, and where motor 7 does not belong"
    assert f"the residual looks like a load from t = 41 s on {HOSTILE}" in words
    assert "a law <b>of tomorrow" in words and "m38: </td> its ticks are too few" in words
    assert "dead zone" in words
    assert "perhaps sensor lag 4 ms (31 %); the residual looks like" in words and "Sensor lag 1" not in words
    # Who could not be identified may be diagnosed: it may say why.
    volts = json.loads(diagnosed_rows()[11]["effect_parameters"])["coulomb_friction"]["volts_V"]
    assert f"record it again Coulomb friction {1e3 * volts:.0f} ± " in words


def test_without_a_diagnosis_there_is_no_word_of_one(told):
    assert "diagnosed" not in "".join(told[1].words)
    assert not any("verdict" in word for word in told[1].words)


def test_what_is_the_same_for_all_motors_is_said(tmp_path):
    same = rows(False)
    for row in same:
        row["gain_rad_s_V"] = 10.0 if row["problem"] is None else None
    write_rows(same, tmp_path / "r.parquet", {})
    words = "".join(Page(fleet_page(tmp_path / "r.parquet")).words)
    assert "without a spread or a correlation: gain; distances are those of the others" in words
    assert "the same for all" in words
    for row in same:
        row["pole_rad_s"] = 40.0 if row["problem"] is None else None
    write_rows(same, tmp_path / "r.parquet", {})
    assert "None: the motors do not differ." in "".join(Page(fleet_page(tmp_path / "r.parquet")).words)


def test_other_parquet_is_one_sentence(tmp_path, capsys):
    (tmp_path / "x.parquet").write_bytes(b"PAR1 not really")
    assert main(["report", str(tmp_path / "x.parquet"), "-o", str(tmp_path / "out")]) == 1
    assert "holds no results" in capsys.readouterr().err and not (tmp_path / "out" / "x.html").exists()


@pytest.mark.parametrize("error", [4.0, 400.0])
def test_intervals_stay_in_their_plot(tmp_path, error):
    """Pole intervals that reach beyond the motors, and one that is much wider than the rest."""
    made = rows(False)
    for row in made:
        if row["pole_standard_error_rad_s"] is not None:
            row["pole_standard_error_rad_s"] = 4.0
    made[3]["pole_standard_error_rad_s"] = error
    write_rows(made, tmp_path / "r.parquet", {})
    page = Page(write_fleet_page(tmp_path / "r.parquet", tmp_path).read_text())
    [panel] = hovers(page)
    left, top, width, height = panel["box"]
    [clip] = [{key: float(value) for key, value in rect.items()} for rect in page.of("rect")]
    box = {"x": left, "y": top, "width": width, "height": height}
    assert clip == pytest.approx(box, abs=0.1)
    [around] = [one["id"] for one in page.of("clippath")]
    lines = [(path, re.fullmatch(r"M(\S+) (\S+)L(\S+) (\S+)", path["d"])) for path in page.of("path")]
    bars = [(path, [float(part) for part in ends.groups()]) for path, ends in lines if ends and path["fill"] == "none"]
    upright = [(path, ends) for path, ends in bars if ends[0] == ends[2] and "e4e4e4" not in path["stroke"]]
    upright = [(path, ends) for path, ends in upright if "clip-path" in path]
    assert len(upright) == 39 and {path["clip-path"] for path, _ in upright} == {f"url(#{around})"}
    places = np.array([y for one in panel["series"] for y in one["y"]])
    assert len(places) == 39 and places.min() >= top and places.max() <= top + height
    assert np.ptp(places) > 0.2 * height


def test_a_large_fleet_stays_small(tmp_path):
    many = [row | {"motor": f"motor number {k}"} for k in range(6000) for row in rows(False)[:1]]
    rng = np.random.default_rng(1)
    for row in many:
        row |= {"gain_rad_s_V": 10 * np.exp(0.05 * rng.normal()), "pole_rad_s": 40 * np.exp(0.05 * rng.normal())}
    write_rows(many, tmp_path / "r.parquet", {})
    assert main(["report", str(tmp_path / "r.parquet"), "-o", str(tmp_path)]) == 0
    assert (tmp_path / "r.html").stat().st_size < 3_000_000
