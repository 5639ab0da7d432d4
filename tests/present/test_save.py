import dataclasses
import xml.etree.ElementTree as ElementTree

import matplotlib
import pytest
from matplotlib.figure import Figure

from jaxmotor import JaxmotorError
from jaxmotor.bench import resolution_table
from jaxmotor.estimate import Model
from jaxmotor.present import encoder, fit_figures, residuals, save, simulation, write_fit, write_validation, zoh_bode
from jaxmotor.validation import OpenLoop, Score, Validation

ROWS = resolution_table(617.4, (0.001, 0.005, 0.02))


def png_size(data: bytes) -> tuple[int, int]:
    return int.from_bytes(data[16:20]), int.from_bytes(data[20:24])


def test_png_has_200_dots_per_inch(tmp_path):
    save(encoder(617.4, ROWS), tmp_path / "figure.png")
    data = (tmp_path / "figure.png").read_bytes()
    assert data.startswith(b"\x89PNG") and png_size(data)[0] == round(12 / 2.54 * 200 - 0.5)
    assert [path.name for path in tmp_path.iterdir()] == ["figure.png"]


def test_svg_is_xml_of_the_same_width(tmp_path):
    save(encoder(617.4, ROWS), tmp_path / "figure.SVG")
    root = ElementTree.parse(tmp_path / "figure.SVG").getroot()
    assert float(root.attrib["width"].removesuffix("pt")) == pytest.approx(72 * 12 / 2.54)


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_the_same_figure_gives_the_same_bytes(tmp_path, suffix, exact, recording):
    for name in ("one", "two"):
        save(residuals(exact, recording), (tmp_path / name).with_suffix(suffix))
    one, two = ((tmp_path / name).with_suffix(suffix).read_bytes() for name in ("one", "two"))
    assert one == two
    assert b"Date" not in one and b"date>" not in one and len(one) < 500_000


def test_settings_around_do_not_matter(tmp_path):
    plain, odd = tmp_path / "plain.png", tmp_path / "odd.png"
    save(zoh_bode(0.005), plain)
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 9, "axes.grid": False, "text.usetex": True}):
        save(zoh_bode(0.005), odd)
    assert plain.read_bytes() == odd.read_bytes()


class Unwilling(Figure):
    """Fails when half of the file is written."""

    def savefig(self, fname, **kwargs):
        del kwargs
        fname.write_bytes(b"half a fig")
        raise RuntimeError("out of ink")


def test_whole_or_not_at_all(tmp_path):
    path = tmp_path / "figure.png"
    path.write_bytes(b"the old one")
    with pytest.raises(RuntimeError, match="out of ink"):
        save(Unwilling(), path)
    assert path.read_bytes() == b"the old one"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "says"), [("figure.pdf", "png or .svg"), ("figure", "png or .svg"), ("no/figure.png", "cannot be written")]
)
def test_what_cannot_be_written_is_said(tmp_path, name, says):
    with pytest.raises(JaxmotorError, match=says):
        save(encoder(617.4, ROWS), tmp_path / name)
    assert not any(tmp_path.iterdir())


def test_a_fit_leaves_its_model_and_its_figures(tmp_path, exact, recording):
    paths = write_fit(exact, recording, tmp_path)
    assert sorted(path.name for path in paths) == [
        "made-bode.png",
        "made-drift.png",
        "made-models.png",
        "made-residuals.png",
        "made-simulation.png",
        "made-sine.png",
        "made.json",
    ]
    assert sorted(tmp_path.iterdir()) == sorted(paths)


def test_without_sines_there_are_no_figures_of_them(exact, recording):
    steps = dataclasses.replace(exact, fitted=(6, 7, 8), frequency_response=None)
    assert set(fit_figures(steps, recording)) == {"simulation", "residuals"}


def test_a_validation_leaves_its_figures(tmp_path, exact, recording):
    score = Score(600, 97.0, 1.0, 0.4, 1.0)
    open_loop = OpenLoop(score, {7: score}, (), True, (exact.traces[7],))
    model = Model(exact.motor, exact.covariance, 0.0, 0.005, "made.csv", frozenset(), "made.json")
    validation = Validation(model, "made.csv", (0,), (7,), (), open_loop, (), (), 0, 100, ())
    assert [path.name for path in write_validation(validation, recording, tmp_path)] == ["made-open-loop.png"]
    assert "held out" in simulation(open_loop, recording).get_suptitle()
