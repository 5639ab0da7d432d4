"""The whole recording, and whether a residual is white."""

import dataclasses

import numpy as np
import pytest
from figures import bands, check, labels, line

from jaxmotor.estimate import Trace
from jaxmotor.present import autocorrelation, overview

WHITE = np.random.default_rng(1).normal(size=20_000)


def trace(residual) -> Trace:
    speed = np.linspace(-3, 3, len(residual))
    return Trace(0, np.arange(len(residual)) * 0.005, speed + residual, speed)


def test_autocorrelation_of_a_known_process():
    """An AR(1) of 0.8, whose autocorrelation is 0.8 to the lag, and white noise."""
    slow = np.zeros(len(WHITE))
    for k in range(1, len(WHITE)):
        slow[k] = 0.8 * slow[k - 1] + WHITE[k]
    figure = autocorrelation({"linear": [trace(slow)], "extended": [trace(WHITE)]})
    check(figure)
    assert labels(figure) == [("Lag (rows)", "Autocorrelation")]
    [ax] = figure.axes
    np.testing.assert_allclose(line(ax, "linear").get_ydata(), 0.8 ** np.arange(26), atol=0.06)
    noise = line(ax, "extended").get_ydata()
    assert noise[0] == 1 and np.abs(noise[1:]).max() < 3 / np.sqrt(len(WHITE))
    [band] = bands(ax)
    np.testing.assert_allclose(band, np.tile([-1, 1], (2, 1)) * 1.96 / np.sqrt(len(WHITE)))
    assert np.mean(np.abs(noise[1:]) < band[0, 1]) > 0.85


def test_segments_are_not_joined():
    """Two segments of opposite sign: across their border nothing is multiplied."""
    one = np.array([1.0, 1.0, -1.0, -1.0])
    shown = line(autocorrelation({"one": [trace(one), trace(-one)]}).axes[0], "one").get_ydata()
    np.testing.assert_allclose(shown[:5], [1, 0.25, -0.5, -0.25, 0])


def test_a_residual_of_nothing_has_no_autocorrelation():
    figure = autocorrelation({"linear": [trace(np.zeros(9))]})
    check(figure)
    assert not line(figure.axes[0], "linear").get_ydata().any()


def test_the_whole_recording_in_stretches(recording):
    figure = overview(recording)
    check(figure)
    assert labels(figure) == [("", "Voltage (V)"), ("Time in the recording (s)", "Speed (rad/s)")]
    end = recording.segments[-1].start_s + recording.segments[-1].time_s[-1]
    volts, speed = figure.axes
    at, mean = volts.get_lines()[0].get_data()
    assert len(at) == 700 and volts.get_lines()[0].get_label() == f"mean of {end / 700:.2g} s"
    segment = recording.segments[3]
    inside = (at > segment.start_s + 0.1) & (at < segment.start_s + segment.time_s[-1] - 0.1)
    wanted = np.interp(at[inside] - segment.start_s, segment.time_s, segment.volts)
    assert inside.sum() > 50 and np.abs(mean[inside] - wanted).max() < 0.3
    np.testing.assert_allclose(np.nanmax(bands(volts)[0]), max(one.volts[:-1].max() for one in recording.segments))
    assert np.nanmax(speed.get_lines()[0].get_ydata()) == pytest.approx(11.0 * 5.1, rel=0.05)
    # Between segments there is nothing.
    gap = (at > segment.start_s + segment.time_s[-1] + 0.1) & (at < recording.segments[4].start_s - 0.1)
    assert gap.any() and np.isnan(mean[gap]).all()


def test_few_rows_are_no_fewer_than_there_are_stretches(recording):
    """A curve of points that stand alone would not be seen."""
    short = dataclasses.replace(recording, segments=recording.segments[:1])
    for ax in overview(short).axes:
        mean = ax.get_lines()[0].get_ydata()
        assert 250 < len(mean) < 300 and np.isfinite(mean).all()


def test_a_recording_of_single_rows_is_an_empty_figure(recording):
    alone = dataclasses.replace(recording.segments[0], **{
        name: getattr(recording.segments[0], name)[:1] for name in ("time_s", "volts", "tick", "duty", "count")
    })  # fmt: skip
    figure = overview(dataclasses.replace(recording, segments=(alone,)))
    assert all(np.isnan(ax.get_lines()[0].get_ydata()).all() for ax in figure.axes)
