import dataclasses

import numpy as np
import pytest
from figures import check, labels, line
from present_rig import COUNTS, GAIN, PERIOD, POLE, Rig

from jaxmotor import JaxmotorError
from jaxmotor.present import position_drift, sine_fit
from jaxmotor.recording import Recording

ONE_COUNT = 2 * np.pi / COUNTS


def test_position_and_drift(recording):
    figure = position_drift(recording, 3, pole_rad_s=POLE)
    check(figure)
    assert labels(figure) == [("Time (s)", "Position (degrees)")]
    position, drift = figure.axes[0].get_lines()
    segment = recording.segments[3]
    np.testing.assert_allclose(position.get_ydata(), (segment.count - segment.count[0]) * 360 / COUNTS)
    slope = np.diff(drift.get_ydata()) / np.diff(drift.get_xdata())
    # The rig's 20 mV, and a third of a millivolt that the duty's rounding leaves in 600 rows.
    np.testing.assert_allclose(slope, np.rad2deg(GAIN * 0.02), rtol=5e-2)
    assert f"{slope[0]:+.3g} degrees/s" in str(drift.get_label())


def test_drift_is_the_middle_of_the_oscillation(recording):
    position, drift = position_drift(recording, 4, pole_rad_s=POLE).axes[0].get_lines()
    around = (position.get_ydata() - drift.get_ydata())[100:]
    assert abs(around.max() + around.min()) < 3


def test_measured_speed_and_both_sines(recording):
    figure = sine_fit(recording, 4, pole_rad_s=POLE)
    check(figure)
    assert labels(figure) == [("", "Speed (rad/s)"), ("Time (s)", "Residual (rad/s)")]
    speed, left = figure.axes
    measured = line(speed, "measured")
    number = len(measured.get_xdata())
    counts = recording.segments[4].count[: number + 1]
    np.testing.assert_allclose(measured.get_ydata(), np.diff(counts) * ONE_COUNT / PERIOD)
    np.testing.assert_allclose(measured.get_xdata(), (np.arange(number) + 0.5) * PERIOD, atol=1e-12)
    ours, theirs = line(speed, "ours"), line(speed, "paper's, at the tick's end")
    np.testing.assert_allclose(theirs.get_xdata() - ours.get_xdata(), PERIOD / 2)
    for name, fitted in (("ours", ours), ("paper's", theirs)):
        np.testing.assert_allclose(line(left, name).get_ydata(), measured.get_ydata() - fitted.get_ydata())
    assert np.abs(line(left, "ours").get_ydata()).max() < 1.2 * ONE_COUNT / PERIOD  # the start included
    assert np.abs(line(left, "paper's").get_ydata()[:3]).max() > 3 * ONE_COUNT / PERIOD


def test_the_sine_is_the_frequency_response_s(recording, exact):
    """Amplitude of our fitted sine over the voltage's, far from the start, is |V| measured by `identify`."""
    time = np.arange(600) * PERIOD
    ours = line(sine_fit(recording, 4, pole_rad_s=POLE).axes[0], "ours").get_ydata()[60:]
    frequency = recording.segments[4].parameters["frequency_Hz"]
    angle = 2 * np.pi * frequency * time[60 : 60 + len(ours)]
    design = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    amplitude = np.hypot(*np.linalg.lstsq(design, ours)[0][:2])
    response = np.abs(np.asarray(exact.frequency_response.response))[4]
    assert amplitude == pytest.approx(5.1 * response, rel=5e-3)


def test_lost_ticks_are_left_out(recording):
    segment = recording.segments[3]
    keep = np.delete(np.arange(len(segment)), [5, 6, 30])
    names = ("time_s", "volts", "tick", "duty", "count")
    shorter = dataclasses.replace(segment, **{name: getattr(segment, name)[keep] for name in names})
    damaged = dataclasses.replace(recording, segments=(*recording.segments[:3], shorter))
    figure = sine_fit(damaged, 3, pole_rad_s=POLE)
    check(figure)
    measured = line(figure.axes[0], "measured").get_xdata()
    # Each of the two gaps costs its rows and the difference across it.
    assert np.setdiff1d(np.arange(40), np.rint(measured / PERIOD - 0.5)).tolist() == [4, 5, 6, 29, 30]


@pytest.mark.parametrize("window", [PERIOD, None])
def test_logged_speeds(window):
    time = np.arange(400) * PERIOD
    rig = Rig()
    rig.record("sine", 3 * np.sin(2 * np.pi * 2.5 * time), frequency_Hz=2.5)
    segment = rig.segments[0]
    speed = np.diff(segment.count, prepend=0) * ONE_COUNT / PERIOD
    logged = dataclasses.replace(segment, count=None, speed_rad_s=speed)
    recording = Recording((logged,), "speeds.csv", PERIOD, speed_window_s=window)
    figure = sine_fit(recording, 0)
    check(figure)
    late = 0 if window is None else PERIOD / 2
    np.testing.assert_allclose(line(figure.axes[0], "measured").get_xdata()[:3], time[:3] - late, atol=1e-12)
    with pytest.raises(JaxmotorError, match="logs speeds"):
        position_drift(recording, 0)


@pytest.mark.parametrize(("segment", "says"), [(7, "kind 'step'"), (99, "no segment 99"), (-1, "no segment -1")])
def test_what_is_no_sine_is_said(recording, segment, says):
    for figure in (position_drift, sine_fit):
        with pytest.raises(JaxmotorError, match=says):
            figure(recording, segment)
