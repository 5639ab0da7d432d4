import numpy as np
import pytest
from figures import bands, check, labels, line
from present_rig import AWKWARD

from jaxmotor import JaxmotorError
from jaxmotor.present import Compared, closed_loop, controller, step, step_trials
from jaxmotor.validation import Band, ClosedLoop, Comparison, Interval, StepTrials

TIME = np.arange(80) * 0.005
SPEED = 56 * (1 - np.exp(-40 * TIME))
NOISE = 0.5 * np.sin(1234.5 * np.arange(80))
NOTHING = Comparison(Interval(1.0, np.nan, np.nan), Interval(1.0, 0.9, 1.1))


def band(values: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
    return values - half, values + half


def compared(**fields) -> Compared:
    return Compared(TIME, SPEED + NOISE, SPEED, **fields)


def test_step_shows_mean_band_and_prediction():
    both = compared(measured_band=band(SPEED + NOISE, 0.7), predicted_band=band(SPEED, 0.4))
    figure = step(both, title=AWKWARD, measured_label="mean of 10 trials")
    check(figure)
    assert labels(figure) == [("", "Speed (rad/s)"), ("Time (s)", "Measured less predicted (rad/s)")]
    speed, left = figure.axes
    np.testing.assert_array_equal(line(speed, "mean of 10 trials").get_ydata(), SPEED + NOISE)
    np.testing.assert_array_equal(line(speed, "predicted").get_ydata(), SPEED)
    measured, predicted = bands(speed)
    np.testing.assert_allclose(measured, np.column_stack(band(SPEED + NOISE, 0.7)))
    np.testing.assert_allclose(predicted, np.column_stack(band(SPEED, 0.4)))
    np.testing.assert_allclose(bands(left)[0], np.tile([-0.7, 0.7], (80, 1)))
    np.testing.assert_allclose(bands(left)[1], np.tile([-0.4, 0.4], (80, 1)))
    np.testing.assert_allclose(left.get_lines()[-1].get_ydata(), NOISE, atol=1e-12)


def test_bands_differ_in_grey_from_each_other():
    figure = step(compared(measured_band=band(SPEED, 1), predicted_band=band(SPEED, 1)))
    fill, hatched = figure.axes[0].collections
    assert not fill.get_hatch() and hatched.get_hatch()


def test_a_step_without_bands():
    figure = step(compared())
    check(figure)
    assert bands(figure.axes[0]) == []


def test_closed_loop_shows_speed_and_effort():
    volts = np.clip(0.5 * (40 - SPEED), -7.4, 7.4)
    effort = Compared(TIME, volts + 0.03, volts, predicted_band=band(volts, 0.1), held=True)
    figure = closed_loop(compared(predicted_band=band(SPEED, 1)), effort, reference_rad_s=40, limit_V=7.4)
    check(figure)
    assert labels(figure) == [("", "Speed (rad/s)"), ("Time (s)", "Control effort (V)")]
    upper, lower = figure.axes
    assert set(line(upper, "reference").get_ydata()) == {40.0}
    assert line(lower, "measured").get_drawstyle() == "steps-post"
    np.testing.assert_array_equal(line(lower, "predicted").get_ydata(), volts)
    assert any(set(each.get_ydata()) == {7.4} for each in lower.get_lines())


def test_a_reference_may_change_and_ticks_may_be_lost():
    reference = np.where(TIME < 0.1, 0.0, 30.0)
    measured = np.where(np.arange(80) % 9 == 4, np.nan, SPEED)
    lost = Compared(TIME, measured, -SPEED, predicted_band=band(-SPEED, 1))
    figure = closed_loop(lost, lost, reference_rad_s=reference)
    check(figure)
    np.testing.assert_array_equal(line(figure.axes[0], "reference").get_ydata(), reference)


@pytest.mark.parametrize(
    "arrays", [(TIME, SPEED[1:], SPEED), (TIME[:0],) * 3, (TIME[:, None], SPEED[:, None], SPEED[:, None])]
)
def test_arrays_of_different_lengths_are_said(arrays):
    with pytest.raises(JaxmotorError, match="one length"):
        Compared(*arrays)


@pytest.mark.parametrize(("segments", "label"), [((3, 4, 5), "mean of 3 trials"), ((3,), "measured, one trial")])
def test_step_trials_of_a_validation(segments, label):
    bands_ = (Band(SPEED + NOISE, *band(SPEED, 1)), Band(SPEED, *band(SPEED, 0.5)))
    figure = step_trials(StepTrials(segments, 5.1, TIME, *bands_, 95.0, NOTHING, NOTHING))
    check(figure)
    np.testing.assert_array_equal(line(figure.axes[0], label).get_ydata(), SPEED + NOISE)
    assert "5.1 V" in figure.get_suptitle() and "held out" in figure.get_suptitle()


@pytest.mark.parametrize("limit", [7.4, np.nan])
def test_controller_of_a_validation(limit):
    volts = np.clip(0.5 * (40 - SPEED), -7.4, 7.4)
    loop = ClosedLoop(
        segment=12,
        kind="PI",
        reference_rad_s=40.0,
        gain_V_s_rad=0.1,
        integral_gain_V_rad=2.0,
        duty_step_V=0.029,
        limit_V=limit,
        time_s=TIME,
        measured_speed_rad_s=SPEED + NOISE,
        measured_volts_V=volts,
        speed=Band(SPEED, *band(SPEED, 1)),
        volts=Band(volts, *band(volts, 0.1)),
        speed_inside_percent=95.0,
        volts_inside_percent=95.0,
        controller_off_percent=0.0,
        rise_time_s=NOTHING,
        overshoot_percent=NOTHING,
        steady_speed_rad_s=NOTHING,
        steady_error_rad_s=NOTHING,
        rmse_rad_s=Interval.alone(0.0),
        theory_error_rad_s=Interval(0.0, 0.0, 0.0),
        theory_error_with_offset_rad_s=0.0,
        saturated_percent=NOTHING,
        notes=(),
    )
    figure = controller(loop)
    check(figure)
    assert "PI control" in figure.get_suptitle()
    np.testing.assert_array_equal(line(figure.axes[1], "measured").get_ydata(), volts)
