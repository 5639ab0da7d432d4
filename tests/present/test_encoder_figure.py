import numpy as np
import pytest
from figures import check, labels, line

from jaxmotor.bench import resolution_table
from jaxmotor.present import encoder


@pytest.mark.parametrize("periods", [(0.005,), (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)])
@pytest.mark.parametrize("speeds", [(), (0.5, 37.7, 1e4)])
def test_encoder_shows_the_table(periods, speeds):
    rows = resolution_table(617.4, periods)
    figure = encoder(617.4, rows, speeds)
    check(figure)
    assert labels(figure) == [
        ("Sampling period (ms)", "Speed error (rpm)"),
        ("Speed (rpm)", "Error of one count (%)"),
    ]
    period, speed = figure.axes
    curve = line(period, "one count")
    np.testing.assert_allclose(curve.get_ydata() * curve.get_xdata(), 60e3 / 617.4)
    (marks,) = [each for each in period.get_lines() if each.get_marker() == "o"]
    np.testing.assert_allclose(marks.get_ydata(), [row.resolution_rpm for row in rows])
    first = speed.get_lines()[0]
    np.testing.assert_allclose(first.get_ydata() * first.get_xdata(), 100 * rows[0].resolution_rpm)
    assert "19.4" in [text.get_text() for text in period.texts]
