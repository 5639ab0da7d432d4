"""What the input cannot tell apart is said, and spanned by intervals of its own."""

import dataclasses
import re

import numpy as np
import pytest
from open_hypotheses import INPUTS, LAWS, case, errors, result
from testing.made import PERIOD, motion, recording, step

from jaxmotor.estimate import Allowed, OpenHypothesis, allowing, identify, to_json
from jaxmotor.estimate._assess import _left_over
from jaxmotor.estimate._hidden import Beside, Hidden
from jaxmotor.estimate._open_hypotheses import has_several_heights, open_hypotheses, shown_laws
from jaxmotor.estimate._uncertainty import HIDDEN, Uncertainty
from jaxmotor.prediction import pack
from jaxmotor.recording import Recording, Segment, bundled

STEPS, PRBS, ONE_WAY = INPUTS
FIRST_ORDER = ("drag", "electrical lag")
"""Laws by which the motor moves not quite in proportion to their amount: one of three may be just outside."""


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("given", INPUTS)
def test_the_truth_is_inside_what_is_left_open(given, law):
    tried = [result(given, law, [11, k], measured) for k, measured in enumerate(("count", "count", "speed"))]
    found = [one for one in tried if one is not None]
    assert len(found) >= 2
    assert sum(one.allowed for one in found) >= len(found) - any(name in law for name in FIRST_ORDER)
    assert all(one.told for one in found if one.z > 5)


@pytest.mark.parametrize("law", ["friction", "dead zone"])
def test_steps_of_one_height_leave_friction_open(law):
    made = case(np.random.default_rng(4), STEPS, law)
    fit = identify(made.recording)
    assert np.abs(errors(fit, made)).max() > 5 and fit.chi2_per_sample < 1.1
    assert {"friction", "dead zone"} <= {one.name for one in fit.open_hypotheses}
    assert sum("add steps of a second height" in note for note in fit.notes) == 2
    content = to_json(fit)
    low, high = content["interval_with_open_hypotheses"]["gain_rad_s_V"]
    assert low < made.gain < high
    assert content["standard_error"]["gain_rad_s_V"] < 0.01 * (high - low)
    assert content["open_hypotheses"][0]["unit"] == "V"


def test_a_motor_that_turns_the_other_way_leaves_the_same_open():
    """Friction is against the motion, whichever way a positive voltage turns it."""
    made = case(np.random.default_rng(4), STEPS, "friction").recording
    turned = [dataclasses.replace(one, volts=-one.volts) for one in made.segments]
    fit, other = identify(made), identify(dataclasses.replace(made, segments=tuple(turned)))
    assert fit.allowed is not None and other.allowed is not None
    assert float(other.motor.gain) == pytest.approx(-float(fit.motor.gain), rel=1e-6)
    assert other.allowed.gain == pytest.approx([-end for end in reversed(fit.allowed.gain)], rel=1e-3)
    assert other.allowed.pole == pytest.approx(fit.allowed.pole, rel=1e-3)
    assert [one.name for one in other.open_hypotheses] == [one.name for one in fit.open_hypotheses]


@pytest.mark.parametrize(
    "volts, several",
    [
        (np.repeat([5.0, 0.0, -5.0], 10), False),
        (np.where(np.arange(300) % 7 < 3, 4.0, -4.02), False),
        (np.repeat([5.0, 0.0, 3.0], 10), True),
        (6 * np.sin(0.1 * np.arange(300)), True),
        (np.zeros(300), False),
    ],
)
def test_what_decides_depends_on_the_heights_there_are(volts, several):
    made = case(np.random.default_rng(4), STEPS, "nothing")
    packed = pack(made.recording, (0,))
    batch = packed.batch._replace(volts=np.resize(volts, packed.batch.volts.shape))
    assert has_several_heights(dataclasses.replace(packed, batch=batch)) == several
    open_ = OpenHypothesis("friction", 0.3, 12.0, 41.0, several=several)
    assert ("small voltages" in open_.note) == several and ("second height" in open_.note) != several
    assert open_.decide in open_.note and "fast changes" in OpenHypothesis("delay", 1.0, 1.0, 1.0, several=several).note


def test_the_gain_under_friction_is_that_of_the_voltage_that_is_left():
    """With friction f, steps of height A turn the motor like one whose gain is K (1 - f/A)."""
    made = case(np.random.default_rng(5), STEPS, "nothing")
    height = float(np.abs(made.recording.segments[0].volts).max())
    [friction] = [one for one in identify(made.recording).open_hypotheses if one.name == "friction"]
    assert friction.gain == pytest.approx(made.gain / (1 - friction.largest / height), rel=0.01)


def test_a_prbs_of_one_amplitude_shows_friction_but_no_dead_zone():
    made = case(np.random.default_rng(6), PRBS, "nothing")
    assert {one.name for one in identify(made.recording).open_hypotheses} == {"dead zone"}


def test_one_direction_leaves_the_gain_alone():
    """Friction is an offset there: levels of different height tell the gain."""
    made = case(np.random.default_rng(7), ONE_WAY, "friction")
    fit = identify(made.recording)
    assert not fit.open_hypotheses and np.abs(errors(fit, made)).max() < 5


def test_an_electrical_time_constant_is_said_to_be_open():
    """Where rows are too long to show it: the pole would be lower with it."""
    made = case(np.random.default_rng([0, 1, 2]), ONE_WAY, "electrical lag")
    fit = identify(made.recording)
    [lag] = [one for one in fit.open_hypotheses if one.name == "electrical lag"]
    assert fit.allowed is not None and fit.allowed.pole[0] < made.pole < float(fit.motor.pole)
    assert lag.pole < float(fit.motor.pole) and any("L/R" in note for note in fit.notes)


@pytest.mark.parametrize("name", ["linear", "paper", "full"])
def test_what_the_recording_decides_is_not_open(name):
    assert not identify(bundled(name)).open_hypotheses


def test_a_law_that_the_recording_shows_is_told_and_not_called_open():
    """The bundled recording's motor: 10.6 rad/s/V, 40 rad/s, 0.2 V of Coulomb friction."""
    fit = identify(bundled("paper"))
    [told] = [note for note in fit.notes if "looks most like" in note]
    found = re.search(r"Coulomb friction \((.*) V\).* about (.*) rad/s/V and the pole (.*) rad/s;", told)
    assert found is not None
    friction, gain, pole = map(float, found.groups())
    assert (friction, gain, pole) == (
        pytest.approx(0.2, rel=0.1),
        pytest.approx(10.6, rel=0.01),
        pytest.approx(40, rel=0.02),
    )
    assert not any("does not show whether" in note for note in fit.notes)
    assert fit.allowed is not None
    assert fit.allowed.gain[0] < 10.6 < fit.allowed.gain[1] and fit.allowed.pole[0] < 40 < fit.allowed.pole[1]


@pytest.mark.parametrize(
    ("volts", "told"), [(0.2, "(0.2 V at the highest speed): with that"), (100.0, "but by more than a motor can have")]
)
def test_of_a_law_beyond_any_motor_no_size_is_told(volts, told):
    """A dead time of a tenth of a second looks like a drag that takes more than there is."""
    packed, shift = pack(bundled("paper"), (0, 1, 2)), np.array([0.1, 0.0])
    [sentence] = shown_laws(packed, np.array([10.0, 40.0]), Beside((Hidden("drag", volts, 0.01, shift, shift),), ()))
    assert told in sentence


@pytest.mark.parametrize(("moves", "told"), [(0.5, "the gain would be"), (40.0, "gain and pole are not determined")])
def test_beyond_first_order_no_motor_is_told(moves, told):
    packed, shift = pack(bundled("paper"), (0, 1, 2)), np.array([0.1, moves])
    beside = Beside((), (Hidden("delay", 0.1, 0.05, shift, shift),))
    [one], allowed = open_hypotheses(packed, np.array([10.0, 40.0]), np.array([0.1, 0.4]), beside)
    assert told in one.note and one.anything == (moves > 1)
    assert allowed.pole[1] > 40 * np.exp(min(0.2 * moves, 3.0))


def test_an_interval_of_many_decades_is_none():
    fit = dataclasses.replace(identify(bundled("paper")), open_hypotheses=(OpenHypothesis("friction", 1.0, 9.0, 40.0),))
    [wide, narrow] = (
        allowing(dataclasses.replace(fit, allowed=Allowed((9.0, 11.0), (low, 50.0)))) for low in (1e-3, 30.0)
    )
    assert wide is not None and wide.endswith("gain 9 to 11 rad/s/V, pole not determined")
    assert narrow is not None and narrow.endswith("pole 30 to 50 rad/s")


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_that_changes_slowly_hides_but_little_friction(seed):
    """Voltages of many heights show friction, whatever else moves the speed in the course of minutes."""
    rng = np.random.default_rng(seed)
    rows = 6000
    volts = np.repeat(rng.uniform(-5, 5, rows), rng.integers(3, 60, rows))[:rows]
    _, turned = motion(volts, 10.0, 20.0)
    slow = np.cumsum(rng.standard_normal(rows))
    noise = 0.03 * slow / slow.std() + 0.005 * rng.standard_normal(rows)
    speed = np.concatenate([[0.0], turned[:-1]]) / PERIOD + noise * turned.std() / PERIOD
    one = Segment("other", 0.0, True, {}, PERIOD * np.arange(rows), volts, tick=np.arange(rows), speed_rad_s=speed)
    fit = identify(Recording((one,), "slow", PERIOD, supply_V=5.0, speed_window_s=PERIOD, duty_delay_s=0.0))
    assert fit.noise.rows_per_reading > 100
    assert all(one.largest < 0.1 for one in fit.open_hypotheses if one.name in ("friction", "dead zone"))
    assert fit.allowed is not None and 9.8 < fit.allowed.gain[0] < 10 < fit.allowed.gain[1] < 10.4


@pytest.mark.parametrize(
    ("law", "amount", "counted"), [("friction", 40.0, 3.0), ("drag", -40.0, -3.0), ("delay", 4, 4)]
)
def test_no_law_takes_more_than_the_voltage(law, amount, counted):
    """Taken to first order one may seem to: it must not widen an interval beyond what a motor can do."""
    packed = pack(recording(0, runs=[step(5.0), step(-5.0)]), (0, 1))
    own = np.eye(len(HIDDEN))[HIDDEN.index(law)]
    names = ("model", "clustered", "clusters", "requantised", "allowance", "pole_share")
    names += ("hidden_score", "hidden_information", "hidden_square")
    quiet = {"evidence": np.array(0.0), "chi2": np.array(5.0), "log10_q": np.array(0.0)}
    judged = Uncertainty(
        **dict.fromkeys(names, np.ones(3)),
        **quiet,
        degrees_of_freedom=np.full(3, 9.0),
        hidden=amount * own,
        hidden_error=np.full(len(HIDDEN), 0.1),
        hidden_shift=np.ones((3, len(HIDDEN))),
    )
    moved = _left_over(packed, judged)
    assert moved is not None and moved == pytest.approx(counted, rel=0.02)
