import dataclasses

import numpy as np
import pytest
from figures import check, labels, line
from present_rig import COUNTS

from jaxmotor.estimate import fit_percent
from jaxmotor.present import residuals, simulation


def test_simulation_has_a_panel_for_each_segment(exact, recording):
    figure = simulation(exact, recording)
    check(figure)
    assert len(figure.axes) == len(exact.traces) == 9
    assert figure.axes[3].get_ylabel() == "Speed\n(rad/s)" and figure.axes[-1].get_xlabel() == "Time (s)"
    for ax, trace in zip(figure.axes, exact.traces, strict=True):
        np.testing.assert_array_equal(line(ax, "measured").get_ydata(), trace.measured_rad_s[:200])
        np.testing.assert_array_equal(line(ax, "simulated").get_ydata(), trace.simulated_rad_s[:200])
        assert f"{fit_percent((trace,)):.1f} %" in ax.get_title(loc="left")
    assert figure.axes[0].get_title(loc="left").startswith("sine 0.502 Hz: ")
    assert figure.axes[-1].get_title(loc="left").startswith("step 5.1 V: ")
    assert f"fit {exact.fit_percent:.2f} %" in figure.get_suptitle()


def test_many_segments_are_spread_over_twelve_panels(exact):
    traces = tuple(dataclasses.replace(exact.traces[k % 9], segment=k) for k in range(40))
    figure = simulation(dataclasses.replace(exact, traces=traces))
    check(figure)
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert len(titles) == 12 and titles[0].startswith("segment 0:") and titles[-1].startswith("segment 39:")
    assert "12 shown" in figure.get_suptitle()


def test_few_segments_leave_no_empty_panels(exact):
    for number in (1, 2, 4):
        figure = simulation(dataclasses.replace(exact, traces=exact.traces[:number]))
        assert len(figure.axes) == number
        check(figure)


def test_a_motor_that_rests_long_is_shown_as_it_moves(exact):
    trace = exact.traces[-1]
    rest = np.zeros(5000)
    late = dataclasses.replace(
        trace,
        time_s=np.arange(5000 + len(trace.time_s)) * 0.005,
        measured_rad_s=np.concatenate([rest, trace.measured_rad_s]),
        simulated_rad_s=np.concatenate([rest, trace.simulated_rad_s]),
    )
    shown = line(simulation(dataclasses.replace(exact, traces=(late,))).axes[0], "measured").get_ydata()
    assert len(shown) <= 1200 and shown[0] == 0 and np.abs(shown).max() > 0.9 * np.abs(trace.measured_rad_s).max()
    ending = dataclasses.replace(late, measured_rad_s=np.concatenate([rest, 0 * trace.measured_rad_s[:-1], [50.0]]))
    assert len(line(simulation(dataclasses.replace(exact, traces=(ending,))).axes[0], "measured").get_ydata()) == 1200
    still = dataclasses.replace(trace, measured_rad_s=0 * trace.measured_rad_s)
    check(simulation(dataclasses.replace(exact, traces=(still,))))


def test_lost_ticks_are_gaps_in_the_curve(exact):
    trace = exact.traces[0]
    keep = np.delete(np.arange(100), np.arange(50, 60))
    shorter = dataclasses.replace(
        trace,
        time_s=trace.time_s[keep],
        measured_rad_s=trace.measured_rad_s[keep],
        simulated_rad_s=trace.simulated_rad_s[keep],
    )
    figure = simulation(dataclasses.replace(exact, traces=(shorter,)))
    assert np.flatnonzero(np.isnan(line(figure.axes[0], "simulated").get_ydata())).tolist() == [50]


def test_residuals_are_in_counts(exact, recording):
    figure = residuals(exact, recording)
    check(figure)
    assert labels(figure) == [
        ("Running time of the segments (s)", "Residual (counts)"),
        ("Density (per count)", ""),
    ]
    shown = np.concatenate([points.get_ydata() for points in figure.axes[0].get_lines() if len(points.get_xdata()) > 2])
    # The definition of the first measure of a model: mean square over what rounding the simulated motion makes.
    per_count = 2 * np.pi / COUNTS / 0.005
    part = np.mod(np.concatenate([trace.simulated_rad_s for trace in exact.traces]) / per_count, 1)
    assert np.mean(shown**2) / np.mean(part * (1 - part)) == pytest.approx(exact.chi2_per_sample, rel=1e-6)
    expected = exact.traces[0].measured_rad_s - exact.traces[0].simulated_rad_s
    np.testing.assert_allclose(shown[: len(expected)], expected * 0.005 * COUNTS / (2 * np.pi), rtol=1e-9)


def test_the_histogram_is_a_density_beside_the_encoder_s(exact, recording):
    ax = residuals(exact, recording).axes[1]
    density = ax.patches[0].get_data()
    assert np.sum(density.values * np.diff(density.edges)) == pytest.approx(1.0)
    triangle = line(ax, "encoder alone")
    assert np.trapezoid(triangle.get_xdata(), triangle.get_ydata()) == 1.0


def test_residuals_without_a_recording_are_speeds(paper):
    figure = residuals(paper)
    check(figure)
    assert figure.axes[0].get_ylabel() == "Residual (rad/s)"
    assert "paper fit" in figure.get_suptitle()
