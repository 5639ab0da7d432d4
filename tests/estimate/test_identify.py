"""The whole identification: truth recovered within its stated error, and a sentence where it cannot be."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize
from testing.made import COUNTS, PERIOD, counted, held, motion, plan, recording, sine, step

from jaxmotor import JaxmotorError, identify
from jaxmotor.estimate import electrical_check
from jaxmotor.recording import Recording, Segment, from_arrays

TRUTH = np.array([11.0, 40.0])


def found(fit):
    return np.array([float(fit.motor.gain), float(fit.motor.pole)])


def stated(fit):
    return np.array([float(fit.standard_error.gain), float(fit.standard_error.pole)])


def scores(fit, truth=TRUTH):
    return (found(fit) - truth) / stated(fit)


def logged(made: Recording, window: float | None = None, **columns) -> Recording:
    """`made` with other columns in place of the counts; functions of the segment's exact motion."""
    segments = []
    for segment in made.segments:
        at, turn = motion(segment.volts, *TRUTH)
        new = {name: make(at, turn) for name, make in columns.items()}
        segments.append(dataclasses.replace(segment, count=None, **new))
    return dataclasses.replace(made, segments=tuple(segments), counts_per_rev=None, speed_window_s=window)


def ramp(ticks=4000):
    return "ramp", {}, held(np.linspace(0, 5.1, ticks))


def test_it_is_the_maximum_of_the_likelihood():
    """Against scipy's minimiser on the dense covariance: gain, pole, offset and process term."""
    made = recording(0, wander=0.02, runs=[sine(1.003, 120), sine(4.013, 120), step(5.1, 60), step(-3.0, 60)])
    fit = identify(made)

    def cost(x):
        gain, pole, offset, log_q = x[0] * 11, np.exp(x[1]), x[2], x[3]
        total = 0.0
        for segment in made.segments:
            first = np.flatnonzero(segment.volts)[0] - 1
            volts, count = segment.volts[max(first, 0) :], segment.count[max(first, 0) :]
            left = np.diff(count) - motion(volts + offset, gain, pole)[1][:-1] * COUNTS / (2 * np.pi)
            size = len(left)
            covariance = (np.exp(log_q) + 1 / 6) * np.eye(size) - (np.eye(size, k=1) + np.eye(size, k=-1)) / 12
            total += left @ np.linalg.solve(covariance, left) + np.linalg.slogdet(covariance)[1]
        return total

    start = np.array([1.0, np.log(40), 0.0, np.log(0.02)])
    options = {"xatol": 1e-9, "fatol": 1e-10, "maxiter": 4000, "maxfev": 4000}
    best = minimize(cost, start, method="Nelder-Mead", options=options).x
    # The process term is found to a few hundredths of a decade, far inside its own uncertainty.
    assert found(fit)[0] == pytest.approx(11 * best[0], abs=0.05 * stated(fit)[0])
    assert found(fit)[1] == pytest.approx(np.exp(best[1]), abs=0.05 * stated(fit)[1])
    assert fit.offset_V == pytest.approx(best[2], abs=0.05 * fit.offset_standard_error_V)


def test_many_recordings_scatter_as_stated():
    all_scores = np.array([scores(identify(recording(seed))) for seed in range(24)])
    assert (np.abs(all_scores) < 4.5).all()
    assert 0.65 < np.sqrt((all_scores**2).mean()) < 1.4


def test_a_hundred_thousandth_of_the_gain_is_reached():
    fit = identify(recording(1))
    assert stated(fit)[0] < 1.5e-5 * 11 and stated(fit)[1] < 1.5e-4 * 40
    assert fit.chi2_per_sample == pytest.approx(1.0, abs=0.06) and fit.floor_known
    assert fit.notes == ()


@pytest.mark.parametrize(
    "disturbed",
    [{"offset": 0.01}, {"friction": 0.05}, {"torque": 0.02}, {"wander": 0.03}, {"friction": 0.4}],
    ids=str,
)
def test_what_the_model_lacks_widens_the_errors(disturbed):
    """The truth stays within three stated errors: never a confident wrong pole."""
    for seed in range(4):
        fit = identify(recording(50 + seed, **disturbed))
        assert (np.abs(scores(fit)) < 3).all(), (fit, fit.notes)
    sharp = stated(identify(recording(50)))
    assert (stated(fit) > (0.5 if "offset" in disturbed else 3.0) * sharp).all()
    if "friction" in disturbed:
        assert any("more than a linear one" in note for note in fit.notes)


def test_a_repeating_encoder_widens_the_errors_and_is_told():
    runs = [sine(f) for f in (1, 2, 3, 5, 6, 8, 10)] + [step(5.1)] * 4
    whole = [identify(recording(seed, runs=runs)) for seed in range(12)]
    all_scores = np.array([scores(fit) for fit in whole])
    assert (np.abs(all_scores) < 4).all()
    detuned = identify(recording(0, runs=[sine(f * 1.0037) for f in (1, 2, 3, 5, 6, 8, 10)] + [step(5.1)] * 4))
    assert stated(whole[0])[1] > 1.4 * stated(detuned)[1]
    assert any("repeats itself" in note for note in whole[0].notes)
    assert not any("repeats itself" in note for note in detuned.notes)


def test_the_sign_of_the_gain_is_measured():
    fit = identify(recording(2, gain=-9.0))
    assert (np.abs(scores(fit, (-9.0, 40.0))) < 4).all()
    assert any("against the voltage" in note for note in fit.notes)


@pytest.mark.parametrize("pole", [3.0, 12.0, 150.0, 600.0])
def test_without_sines_the_data_start_the_fit(pole):
    rng = np.random.default_rng(4)
    prbs = ("prbs", {}, held(np.repeat(rng.choice([-5.1, 5.1], 150), 8)))
    made = recording(9, pole=pole, runs=[prbs, step(5.1), step(-3.0)])
    fit = identify(made)
    assert fit.frequency_response is None
    assert (np.abs(scores(fit, (11.0, pole))) < 4.5).all()
    assert found(fit)[1] == pytest.approx(pole, rel=2e-2)


def test_lost_ticks_and_a_start_at_speed():
    runs = [sine(f) for f in (0.503, 2.009, 6.019)] + [step(5.1), step(-4.0)]
    rng = np.random.default_rng(11)
    angles, speeds = [], [20.0, 0.0, -15.0, 0.0, 0.0]
    for speed, (_, _, volts) in zip(speeds, runs, strict=True):
        angles.append(np.concatenate([[0.0], np.cumsum(motion(volts, *TRUTH, speed=speed)[1])[:-1]]))
    whole = counted(angles, runs, rng)
    segments = []
    for segment, speed in zip(whole.segments, speeds, strict=True):
        kept = np.arange(len(segment))
        if segment.kind == "sine":
            kept = kept[(rng.uniform(size=len(kept)) > 0.01) & ((kept < 400) | (kept > 430))]
        columns = {name: getattr(segment, name)[kept] for name in ("time_s", "volts", "tick", "count")}
        segments.append(dataclasses.replace(segment, at_rest=speed == 0.0, **columns))
    fit = identify(dataclasses.replace(whole, segments=tuple(segments)))
    assert (np.abs(scores(fit)) < 4).all() and stated(fit)[1] < 1e-3 * 40


@pytest.mark.parametrize("kind", ["angle", "mean", "instantaneous", "window"])
def test_logs_without_counts(kind):
    """Angle; mean speed over the last tick; speed at the tick; mean over the last three ticks and a half."""
    rng, made = np.random.default_rng(3), recording(0)
    window = {"angle": None, "mean": PERIOD, "instantaneous": 0.0, "window": 3.5 * PERIOD}[kind]

    def angle(at, turn):
        exact = np.concatenate([[0.0], np.cumsum(turn)[:-1]])
        return exact + 1e-3 * rng.normal(size=len(exact))

    def speed(at, turn):
        if kind == "instantaneous":
            return at + 0.05 * rng.normal(size=len(at))
        position = np.concatenate([np.zeros(4), [0.0], np.cumsum(turn)])
        fine = lambda back: np.array([position[4 + k - back] for k in range(len(turn))])  # noqa: E731
        if kind == "mean":
            return (fine(0) - fine(1)) / PERIOD + 0.05 * rng.normal(size=len(turn))
        # Half a tick back: exact, from the state at the tick before.
        half = np.array([np.nan] * 4 + [midway(at, turn, made, k) for k in range(4, len(turn))])
        return (fine(0) - half) / window + 0.05 * rng.normal(size=len(turn))

    def midway(at, turn, made, k):
        p = np.exp(-40 * PERIOD / 2)
        inside = at[k - 4] * (1 - p) / 40 + 11.0 * volts_of[id(turn)][k - 4] * (PERIOD / 2 - (1 - p) / 40)
        return np.cumsum(turn)[k - 5] + inside if k > 4 else inside

    volts_of = {}
    segments = []
    for segment in made.segments:
        at, turn = motion(segment.volts, *TRUTH)
        volts_of[id(turn)] = segment.volts
        column = {"angle_rad": angle(at, turn)} if kind == "angle" else {"speed_rad_s": speed(at, turn)}
        new = dataclasses.replace(segment, count=None, **column)
        if kind == "window":
            cut = {n: getattr(new, n)[4:] for n in ("volts", "tick", "speed_rad_s")}
            new = dataclasses.replace(new, time_s=new.time_s[4:] - new.time_s[4], at_rest=False, **cut)
        segments.append(new)
    log = dataclasses.replace(made, segments=tuple(segments), counts_per_rev=None, speed_window_s=window)
    fit = identify(log)
    assert not fit.floor_known
    assert (np.abs(scores(fit)) < 4.5).all(), (fit, fit.notes)
    assert stated(fit)[1] < 0.02 * 40
    assert 0.7 < fit.chi2_per_sample < 1.4


def test_uneven_time_stamps():
    rng = np.random.default_rng(6)
    segments = []
    made = recording(0, runs=plan()[2:])
    for segment in made.segments:
        turn = motion(segment.volts, *TRUTH)[1]
        angle = np.concatenate([[0.0], np.cumsum(turn)[:-1]])
        # Rows in which the voltage stays the same as before can be left out without a change of the motion.
        same = np.concatenate([[False], np.diff(segment.volts) == 0])
        kept = ~same | (rng.uniform(size=len(same)) > 0.5)
        new = dataclasses.replace(
            segment,
            tick=None,
            count=None,
            time_s=segment.time_s[kept],
            volts=segment.volts[kept],
            angle_rad=angle[kept] + 1e-3 * rng.normal(size=kept.sum()),
        )
        segments.append(new)
    log = dataclasses.replace(made, segments=tuple(segments), period_s=None, counts_per_rev=None)
    fit = identify(log)
    assert fit.frequency_response is None
    assert (np.abs(scores(fit)) < 4.5).all()


def test_second_order_where_the_data_show_it():
    from scipy.signal import cont2discrete, dlsim

    tau, runs, angles = 3e-3, plan(), []
    matrix = np.array([[0, 40.0, 0], [-1 / tau, -1 / tau, 0], [1.0, 0, 0]])
    a, b, *_ = cont2discrete((matrix, np.array([[0], [11 / tau], [0]]), np.eye(3), np.zeros((3, 1))), PERIOD)
    for _, _, volts in runs:
        angles.append(dlsim((a, b, np.eye(3), np.zeros((3, 1)), PERIOD), volts)[2][:, 2])
    made = counted(angles, runs, np.random.default_rng(1))
    fit = identify(made, model="second")
    assert (np.abs(scores(fit)) < 4).all()
    error = float(fit.motor.electrical_time_constant) - tau
    assert abs(error) < 4 * float(fit.standard_error.electrical_time_constant) < 2e-5
    assert fit.covariance.shape == (3, 3)
    wrong = identify(made)
    assert (np.abs(scores(wrong)) < 3).all() and stated(wrong)[1] > 20 * stated(fit)[1]


def test_second_order_is_refused_where_the_data_do_not():
    fit = identify(recording(3), model="second")
    assert type(fit.motor).__name__ == "FirstOrder"
    assert any("does not show an electrical time constant" in note for note in fit.notes)


def test_eq_10_for_a_measured_winding():
    sentence = electrical_check(recording(0), 4.5, 524e-6)
    assert "2 pi f L/R (eq. 10) is 0.00734 at 10.037 Hz" in sentence and "may be neglected" in sentence
    with pytest.raises(JaxmotorError, match="inductance"):
        electrical_check(recording(0), 4.5, -1.0)


def test_held_out_segments_are_not_looked_at():
    made = recording(4)
    spoiled = dataclasses.replace(
        made.segments[-1], count=made.segments[-1].count + np.arange(len(made.segments[-1])) % 3 * 4
    )
    with_spoiled = dataclasses.replace(made, segments=(*made.segments[:-1], spoiled))
    last = len(made.segments) - 1
    fit, same = identify(made, hold_out=[last]), identify(with_spoiled, hold_out=[last])
    assert fit.held_out == (last,) and last not in fit.fitted
    np.testing.assert_array_equal(found(fit), found(same))
    assert {trace.segment for trace in fit.traces} == set(fit.fitted)


def test_the_traces_are_the_recordings_speed():
    made = recording(5)
    trace = identify(made).traces[0]
    segment = made.segments[0]
    np.testing.assert_allclose(trace.measured_rad_s, np.diff(segment.count) * 2 * np.pi / (COUNTS * PERIOD))
    expected = motion(segment.volts, *TRUTH)[1][:-1] / PERIOD
    assert np.abs(trace.simulated_rad_s - expected).max() < 1e-2


@pytest.mark.parametrize(
    "made, words",
    [
        (lambda: recording(0, runs=[sine(5.017)]), "one frequency"),
        (lambda: recording(0, runs=[sine(5.017), sine(5.017)]), "one frequency"),
        (lambda: recording(0, runs=[ramp()]), "pole is not determined"),
        (lambda: recording(0, runs=[ramp(), ramp(2000)], wander=0.05), "pole is not determined"),
        (lambda: recording(0, gain=1e-4), "never moved"),
    ],
)
def test_what_cannot_be_identified_is_said(made, words):
    with pytest.raises(JaxmotorError, match=words) as caught:
        identify(made())
    assert "\n" not in str(caught.value) and str(caught.value).startswith("made.csv: ")


def wandering(seed: int) -> Recording:
    """A speed that wanders, whatever the voltage."""
    rng, ticks = np.random.default_rng(seed), 1500
    volts = np.repeat(rng.uniform(-6, 6, 30), 50)
    speed = np.convolve(np.cumsum(rng.standard_normal(ticks)), np.ones(25) / 25, "same")
    speed = speed + 0.02 * rng.standard_normal(ticks)
    segment = Segment("other", 0.0, False, {}, 0.02 * np.arange(ticks), volts, tick=np.arange(ticks), speed_rad_s=speed)
    return Recording((segment,), "walk", 0.02, speed_window_s=0.0, supply_V=12.0)


@pytest.mark.parametrize("seed", [4, 13])
def test_a_motor_that_may_turn_either_way_is_none(seed):
    """The gain that fits best is negative."""
    with pytest.raises(JaxmotorError, match="leaves open which way the motor turns"):
        identify(wandering(seed))


def test_a_gain_whose_interval_holds_zero_is_said_not_to_be_determined():
    fit = identify(wandering(0))
    assert 0 < float(fit.motor.gain) < 1.96 * float(fit.standard_error.gain)
    assert any("the linear motor's gain is not determined" in note for note in fit.notes)


def test_nothing_left_to_fit():
    made = recording(0)
    with pytest.raises(JaxmotorError, match="hold fewer out"):
        identify(made, hold_out=range(len(made.segments)))
    with pytest.raises(JaxmotorError, match="no segment 99"):
        identify(made, hold_out=[99])


def test_the_callers_precision_is_left_alone():
    import jax

    assert not jax.config.jax_enable_x64
    fit = identify(recording(6))
    assert not jax.config.jax_enable_x64
    assert fit.motor.gain.dtype == np.float64 and isinstance(fit.motor.gain, np.ndarray)


@pytest.mark.parametrize("height, at_rest", [(5.1, True), (-3.0, True), (5.1, False)])
def test_a_step_of_one_height_gives_the_gain_without_an_offset(height, at_rest):
    """Gain and offset are one there: of a log that begins as the motor is switched on, or after that."""
    made = recording(3, runs=[step(height, 400)])
    [index] = [index for index, segment in enumerate(made.segments) if segment.kind == "step"]
    segment = made.segments[index]
    first = int(np.flatnonzero(segment.volts)[0]) + (0 if at_rest else 3)
    kept = slice(first, int(np.flatnonzero(segment.volts)[-1]) + 1)
    fields = {name: getattr(segment, name)[kept] for name in ("time_s", "volts", "tick", "count")}
    begun = dataclasses.replace(segment, at_rest=at_rest, kind="other", parameters={}, **fields)
    fit = identify(dataclasses.replace(made, segments=(begun,)))
    assert (np.abs(scores(fit)) < 3).all() and stated(fit)[0] < 0.002 * TRUTH[0]
    assert fit.offset_V == 0 and not fit.has_offset and "offset" not in repr(fit).split("note:")[0]
    assert any("constant voltage error" in note and "a second height" in note for note in fit.notes)
    # Friction in one direction is an offset, too: what it could move is in the intervals.
    assert fit.allowed.gain[1] > 1.5 * TRUTH[0] and {"friction", "dead zone"} <= {
        one.name for one in fit.open_hypotheses
    }


@pytest.mark.parametrize(("rows", "more"), [(600, "more steps"), (20, "a longer recording")])
def test_what_would_tell_more_depends_on_how_many_steps_there_are(rows, more):
    """Speeds in much noise, of a voltage that changes after so many rows."""
    row = np.arange(1200)
    volts, speed = np.where((row // rows) % 2, 6.0, 3.0), np.zeros(1200)
    for k in row[1:]:
        speed[k] = speed[k - 1] + (1 - np.exp(-0.08)) * (20 * volts[k - 1] - speed[k - 1])
    read = speed + np.random.default_rng(0).normal(0, 12 if rows == 600 else 60, 1200)
    fit = identify(from_arrays(time_s=0.01 * row, volts=volts, speed_rad_s=read, speed_window_s=0.0))
    [told] = [note for note in fit.notes if note.startswith("the pole is")]
    assert told.endswith(f"{more} would tell more")
