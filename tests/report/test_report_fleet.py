"""A fleet's results, with hostile names, as a page."""

import numpy as np
import pytest
from report_pages import HOSTILE, Page, check_closed, check_readable, hovers

from jaxmotor.cli import main
from jaxmotor.fleet import population, read_results
from jaxmotor.fleet._table import FRICTION_NUMBERS, NUMBERS, write_rows

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


def test_other_parquet_is_one_sentence(tmp_path, capsys):
    (tmp_path / "x.parquet").write_bytes(b"PAR1 not really")
    assert main(["report", str(tmp_path / "x.parquet"), "-o", str(tmp_path / "out")]) == 1
    assert "holds no results" in capsys.readouterr().err and not (tmp_path / "out" / "x.html").exists()


def test_a_large_fleet_stays_small(tmp_path):
    many = [row | {"motor": f"motor number {k}"} for k in range(6000) for row in rows(False)[:1]]
    rng = np.random.default_rng(1)
    for row in many:
        row |= {"gain_rad_s_V": 10 * np.exp(0.05 * rng.normal()), "pole_rad_s": 40 * np.exp(0.05 * rng.normal())}
    write_rows(many, tmp_path / "r.parquet", {})
    assert main(["report", str(tmp_path / "r.parquet"), "-o", str(tmp_path)]) == 0
    assert (tmp_path / "r.html").stat().st_size < 3_000_000
