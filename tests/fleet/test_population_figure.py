import numpy as np
from test_population import fleet

from jaxmotor.fleet._population import population_of
from jaxmotor.present import population_figure, save


def test_population_figure(tmp_path):
    estimates, errors = fleet()
    estimates[7] += (0.0, 0.5)
    motors = tuple(f"unit $x^{k}$ <b>" for k in range(len(estimates)))
    found = population_of(("gain_rad_s_V", "pole_rad_s"), (True, True), motors, estimates, errors)
    figure = population_figure(found)
    [ax] = figure.axes
    texts = [text.get_text() for text in ax.texts]
    assert any(r"unit \$x^7\$" in text for text in texts)
    labels = list(ax.get_legend_handles_labels()[1])
    assert "motors" in labels and "do not belong" in labels
    ellipse = next(line for line in ax.lines if "50 %" in str(line.get_label()))
    x = np.log(ellipse.get_xdata())
    # Half of two normal numbers lie within 1.177 standard deviations.
    assert abs(np.ptp(x) / 2 - 1.1774 * found.spread[0]) < 1e-3
    save(figure, tmp_path / "p.png")
    one = population_of(("gain_rad_s_V",), (True,), motors, estimates[:, :1], errors[:, :1, :1])
    save(population_figure(one), tmp_path / "one.svg")
    assert (tmp_path / "p.png").stat().st_size > 10_000
