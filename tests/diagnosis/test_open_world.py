"""Laws that are in no vocabulary, hidden in plain numpy motion: learned over the right coordinate, in their shape."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from testing.made import COUNTS, PERIOD, SCALE, SUPPLY, plan, sine

from jaxmotor import diagnose, read_model, validate
from jaxmotor.diagnosis import to_json
from jaxmotor.diagnosis._learned_law import resemblances
from jaxmotor.estimate import model_to_json
from jaxmotor.motor.effects import BUILT_IN, Rig
from jaxmotor.motor.effects._learned import TorqueOverSpeed, VoltageBend, VoltageOverCommand
from jaxmotor.recording import Recording, Segment

RIG = Rig(SUPPLY, (2.0, 4.0, 6.0), 60.0, PERIOD, 60.0, turns=True)
RUNS = [*plan(), *(sine(f, amplitude=2.0) for f in (0.7037, 1.507, 3.011))]
GAIN, POLE, FINE = 11.0, 40.0, 5
LATE_S, LIMIT_V, DEAD_V = 21.3, 3.4, 0.6


def over_speed(speed):
    return -0.2 * np.tanh(speed / 20) - 0.1 * np.sin(speed / 8)


def over_angle(angle):
    return 0.2 * np.exp(-(((angle % (2 * np.pi) - 2.0) / 0.6) ** 2))


def over_time(time):
    return -0.25 * (time > LATE_S)


def over_voltage(volts):
    return 0.3 * np.sin(volts / 1.5) - 0.02 * volts**2


LAWS = {
    "speed": lambda volts, speed, angle, time: over_speed(speed),
    "angle": lambda volts, speed, angle, time: over_angle(angle),
    "time": lambda volts, speed, angle, time: over_time(time),
    "voltage": lambda volts, speed, angle, time: over_voltage(volts),
    "nothing": lambda volts, speed, angle, time: 0.0,
}


def misread(angle):
    return 0.1 * np.exp(-(((angle % (2 * np.pi) - 2.0) / 0.6) ** 2))


def hidden(law, seed, runs=RUNS, misread=lambda angle: 0.0):
    """A motor's recording with `law` [V] added to its voltage in every fifth of a tick, and (n, 2) speeds and volts;
    `misread` [rad] is added to the angle that is counted.

    The shaft goes on turning where the run before left it, so that the counter shows its angle throughout.
    """
    rng, step = np.random.default_rng(seed), PERIOD / FINE
    keep = np.exp(-POLE * step)
    mean = (1 - keep) / (POLE * step)
    segments, visited, angle, begin, offset = [], [], 0.0, 0.0, rng.uniform()
    for kind, parameters, volts in runs:
        speed, angles = 0.0, []
        for k, applied in enumerate(volts):
            angles.append(angle)
            for part in range(FINE):
                time = begin + (k * FINE + part + 0.5) * step
                asked = applied + law(applied, speed, angle + 0.5 * step * speed, time)
                visited.append((speed, applied))
                angle += step * (mean * speed + GAIN * (1 - mean) * asked)
                speed = keep * speed + GAIN * (1 - keep) * asked
        tick = np.arange(len(volts))
        read = np.array(angles) + misread(np.array(angles))
        count = np.floor(read * COUNTS / (2 * np.pi) + offset).astype(np.int64)
        segments.append(Segment(kind, begin, True, parameters, tick * PERIOD, volts, tick=tick, count=count))
        begin += len(volts) * PERIOD + 0.5
    made = Recording(tuple(segments), "made.csv", PERIOD, COUNTS, float(SCALE), SUPPLY)
    return made, np.array(visited)


def level(at, curve, visited):
    """`curve` at places `at` without the slope that it has over the `visited` places, and that slope."""
    x = visited - visited.mean()
    slope = float(x @ np.interp(visited, at, curve) / (x @ x))
    return curve - slope * at, slope


@pytest.fixture(scope="module")
def found():
    """Diagnoses and what was visited, by law."""
    made = {}

    def of(name):
        if name not in made:
            recording, visited = hidden(LAWS[name], list(LAWS).index(name))
            made[name] = diagnose(recording), visited
        return made[name]

    return of


def the_law(diagnosis, coordinate):
    """The one curve that was learned, which is all that the motor lacked."""
    assert diagnosis.verdict == "extended" and diagnosis.whole.after.chi2_per_sample < 1.05
    assert diagnosis.held_out.drift_after < 1.3 < 50 < diagnosis.held_out.drift_before
    [effect], [law] = diagnosis.effects, diagnosis.learned
    assert effect.curve is law and law.coordinate == coordinate and law.share > 0.98
    assert effect.probability > 0.95 and effect.name in diagnosis.probabilities
    return law


def check(law, true, size):
    error = law.values - true
    assert np.ptp(true) == pytest.approx(size, rel=0.3)
    assert np.abs(error).max() < 0.1 * np.ptp(true)
    inside = np.abs(error) < 2 * law.standard_error + 0.02 * np.ptp(true)
    assert np.mean(inside) >= 0.9
    # A band is no excuse.
    assert np.median(law.standard_error) < 0.02 * np.ptp(true)


def test_a_friction_that_is_in_no_vocabulary(found):
    diagnosis, visited = found("speed")
    law = the_law(diagnosis, "speed")
    true, slope = level(law.at, over_speed(law.at), visited[:, 0])
    # The slope is the motor's, as far as its line and the curve's are one.
    _, own = level(law.at, law.values, visited[:, 0])
    check(law, true + own * law.at, 0.3)
    assert "like no known law" in law.resemblance
    assert float(diagnosis.motor.linear.pole) == pytest.approx(POLE * (1 - GAIN * (slope - own)), rel=5e-3)


def test_a_bump_over_the_angle(found):
    law = the_law(found("angle")[0], "angle")
    check(law, over_angle(law.at), 0.2)
    assert law.at[[0, -1]] == pytest.approx([0, 2 * np.pi]) and law.values[0] == pytest.approx(law.values[-1])


def test_an_angle_that_is_misread():
    recording, _ = hidden(LAWS["nothing"], 13, misread=misread)
    diagnosis = diagnose(recording)
    law = the_law(diagnosis, "angle")
    assert law.unit == "rad" and "mrad" in law.text and "an error of the reading" in law.text
    # Its mean is the angle from which the counter counts.
    mean = misread(law.at)[:-1].mean()
    check(law, misread(law.at - mean) - mean, 0.1)
    assert float(diagnosis.motor.linear.gain) == pytest.approx(GAIN, rel=2e-4)
    [told] = to_json(diagnosis)["learned"]
    assert told["unit"] == "rad" and told["error_rad"] == law.values.tolist() and "volts_V" not in told


def test_a_drive_that_is_not_in_proportion(found):
    diagnosis, visited = found("voltage")
    law = the_law(diagnosis, "voltage")
    true, slope = level(law.at, over_voltage(law.at), visited[:, 1])
    _, own = level(law.at, law.values, visited[:, 1])
    ratio = float(diagnosis.motor.linear.gain) / GAIN
    # u + f(u) = ratio (u + g(u))
    check(law, (law.at * (1 + slope) + true) / ratio - law.at, 0.9)
    assert ratio * (1 + own) == pytest.approx(1 + slope, abs=0.01)


def test_a_drive_that_saturates_is_a_curve_with_bends():
    """A smooth series would leave much of it about the voltage from which on it is cut off."""
    recording, visited = hidden(lambda volts, speed, angle, time: np.clip(volts, -LIMIT_V, LIMIT_V) - volts, 11)
    asked = ["voltage_over_command", "missed_counts"]
    diagnosis = diagnose(recording, effects=asked)
    [effect], [law] = diagnosis.effects, diagnosis.learned
    assert diagnosis.verdict == "extended" and diagnosis.whole.after.chi2_per_sample < 1.05
    assert diagnosis.held_out.drift_after < 2 < 5000 < diagnosis.held_out.drift_before
    assert law.coordinate == "voltage" and law.share > 0.99
    assert effect.parameters["bend_share"] * effect.parameters["reach_V"] == pytest.approx(LIMIT_V, rel=0.01)
    true, slope = level(law.at, np.clip(law.at, -LIMIT_V, LIMIT_V) - law.at, visited[:, 1])
    _, own = level(law.at, law.values, visited[:, 1])
    ratio = float(diagnosis.motor.linear.gain) / GAIN
    error = law.values - ((law.at * (1 + slope) + true) / ratio - law.at)
    assert np.abs(error).max() < 0.01 * np.ptp(true)
    assert ratio * (1 + own) == pytest.approx(1 + slope, abs=0.01)
    assert "saturation" in law.resemblance


def test_what_one_bend_says_takes_no_curve_of_many_terms():
    """A dead zone that nobody knows of: beside the series the bend alone predicts blocks left out better."""
    recording, visited = hidden(lambda volts, speed, angle, time: -np.clip(volts, -DEAD_V, DEAD_V), 12)
    diagnosis = diagnose(recording, effects=["voltage_bend", "voltage_over_command", "missed_counts"])
    [effect], [law] = diagnosis.effects, diagnosis.learned
    assert effect.name == "voltage_bend" and effect.probability > 0.8
    assert diagnosis.verdict == "extended" and diagnosis.whole.after.chi2_per_sample < 1.05
    assert effect.parameters["bend_share"] * effect.parameters["reach_V"] == pytest.approx(DEAD_V, rel=0.01)
    assert law.resembles[0].name == "dead_zone" and law.resembles[0].similarity > 0.999
    # u + f(u) = ratio (u + g(u))
    ratio = float(diagnosis.motor.linear.gain) / GAIN
    true = (law.at - np.clip(law.at, -DEAD_V, DEAD_V)) / ratio - law.at
    assert np.abs(law.values - true).max() < 0.01 * DEAD_V
    slope, own = (level(law.at, one, visited[:, 1])[1] for one in (-np.clip(law.at, -DEAD_V, DEAD_V), law.values))
    assert ratio * (1 + own) == pytest.approx(1 + slope, abs=0.01)


def test_a_load_that_appears_is_no_part_of_the_motor(found):
    diagnosis, _ = found("time")
    [step] = diagnosis.disturbances
    assert diagnosis.verdict == "unexplained" and not diagnosis.effects and diagnosis.motor.effects == ()
    assert step.name == "load_step" and step.parameters["volts_V"] == pytest.approx(0.25, abs=0.002)
    assert abs(step.parameters["moment_s"] - LATE_S) < 3 * step.standard_error["moment_s"] < 0.03
    assert diagnosis.looks_like.coordinate == "time" and "a change at t = 21.3 s" in diagnosis.looks_like.text
    assert float(diagnosis.motor.linear.gain) == pytest.approx(GAIN, rel=2e-4)
    assert float(diagnosis.motor.linear.pole) == pytest.approx(POLE, rel=2e-3)


def test_a_drive_that_grows_at_one_moment():
    recording, _ = hidden(lambda volts, speed, angle, time: 0.07 * volts * (time > 20.0), 7)
    diagnosis = diagnose(recording)
    [step] = diagnosis.disturbances
    assert not diagnosis.effects and step.name == "drive_step"
    assert step.parameters["change_ratio"] == pytest.approx(0.07, abs=5e-4)
    assert step.parameters["moment_s"] == pytest.approx(20.0, abs=0.02)
    assert diagnosis.whole.after.chi2_per_sample < 1.05


def test_nothing_is_learned_where_nothing_is_hidden(found):
    diagnosis, _ = found("nothing")
    assert diagnosis.verdict == "complete" and diagnosis.learned == () and diagnosis.named == ()


def test_a_known_shape_is_named_with_its_size():
    recording, _ = hidden(lambda volts, speed, angle, time: -0.004 * volts**3, 3)
    law = the_law(diagnose(recording, exclude=["cubic_drive"]), "voltage")
    shape = law.resembles[0]
    assert shape.name == "cubic_drive" and shape.similarity > 0.99
    assert shape.most == pytest.approx(0.004 * np.abs(law.at).max() ** 3, rel=0.15)
    assert 0 < shape.standard_error < 0.01 * shape.most and "cube" in law.text


def test_a_learned_law_is_kept_with_the_model(found, tmp_path):
    diagnosis, _ = found("angle")
    (tmp_path / "motor.json").write_text(json.dumps(model_to_json(diagnosis.model)))
    model = read_model(tmp_path / "motor.json")
    [effect] = model.effects
    assert effect.name == "torque_over_angle"
    for name, value in diagnosis.effects[0].parameters.items():
        assert float(getattr(effect, name)) == value
    other, _ = hidden(LAWS["angle"], 11, RUNS[:8])
    before, after = (validate(one, other, simulations=64).open_loop.pooled for one in (diagnosis.fit, model))
    assert after.chi2_per_sample < 1.1 < before.chi2_per_sample


def test_a_curve_over_speed_leaves_lines_to_the_motor_and_an_offset():
    with jax.enable_x64(True):
        place = np.linspace(-50, 50, 2001)
        for term in range(1, 25):
            effect = TorqueOverSpeed.start(reach_rad_s=50.0, **{f"c{term}_V": 1.0})
            volts = np.asarray(effect.adds(jnp.asarray(place)))
            for line in (place, np.ones_like(place)):
                assert abs(volts @ line) < 1e-9 * np.linalg.norm(line) * max(np.linalg.norm(volts), 1.0)
        for bend in ("bend_V", "even_bend_V"):
            bent = TorqueOverSpeed.start(reach_rad_s=50.0, bend_share=0.6, **{bend: 1.0}).adds(jnp.asarray(place))
            # At an end of its reach it is one volt beside the straight line.
            assert np.ptp(np.asarray(bent)) > 0.5
            for line in (place, np.ones_like(place)):
                assert abs(float(bent @ line)) < 2e-3 * np.linalg.norm(line) * np.linalg.norm(bent)


def test_a_curve_over_the_command_is_zero_without_one():
    with jax.enable_x64(True):
        for term in range(1, 25):
            effect = VoltageOverCommand.start(reach_V=6.0, **{f"c{term}_V": 1.0})
            assert abs(float(effect.adds(jnp.asarray(0.0)))) < 1e-12
        bent = VoltageOverCommand.start(reach_V=6.0, bend_V=1.0, even_bend_V=0.5, bend_share=0.5)
        low, at, high = (float(bent.adds(jnp.asarray(volts))) for volts in (-6.0, 0.0, 6.0))
        assert at == 0.0 and high + low == pytest.approx(1.0) and high - low == pytest.approx(2 * (1 - 0.625))


def test_a_curve_has_no_bends_until_they_have_a_place():
    with jax.enable_x64(True):
        for law in (TorqueOverSpeed, VoltageOverCommand, VoltageBend):
            bends = dict.fromkeys(law.bend_terms, 1.0)
            assert not np.any(law.start(**bends).adds(jnp.linspace(-2.0, 2.0, 41)))
        assert not VoltageBend.start(bend_V=1.0).possible(RIG)


@pytest.mark.parametrize("share", [0.02, 0.2, 0.5, 0.98])
def test_a_bend_is_as_many_volts_as_it_says_and_has_no_straight_line(share):
    with jax.enable_x64(True):
        at = np.linspace(-6, 6, 24_001)
        adds = np.asarray(VoltageBend.of(bend_V=0.4, bend_share=share, reach_V=6.0).adds(jnp.asarray(at)))
    assert np.abs(adds).max() == pytest.approx(0.4, rel=1e-3)
    assert abs(adds @ at) < 1e-3 * np.linalg.norm(adds) * np.linalg.norm(at)
    slopes = np.diff(adds[at >= 0]) / np.diff(at[at >= 0])
    inside = at[at >= 0][1:] < share * 6.0 - 1e-9
    for part in (slopes[inside], slopes[~inside][1:]):
        np.testing.assert_allclose(part, part[0], rtol=1e-6)


@pytest.mark.parametrize(
    ("law", "low", "high", "curve", "name", "text"),
    [
        ("torque_over_speed", -50, 50, lambda w: 0.3 - 0.2 * np.sign(w) + 0.01 * w, "coulomb_friction", "Coulomb"),
        ("torque_over_speed", -50, 50, lambda w: -1e-4 * w * np.abs(w) + 0.02 * w, "quadratic_drag", "square"),
        ("voltage_over_command", -6, 6, lambda u: -np.clip(u, -0.5, 0.5) + 0.1 * u, "dead_zone", "0.5 V"),
        ("voltage_over_command", -6, 6, lambda u: -np.where(np.abs(u) < 1, u, 0), "input_threshold", "1 V"),
        ("voltage_over_command", -6, 6, lambda u: np.clip(u, -4.5, 4.5) - u, "voltage_saturation", "4.5 V"),
        ("voltage_over_command", -6, 6, lambda u: -0.05 * np.abs(u), "direction_asymmetry", "one way"),
        ("torque_over_angle", 0, 2 * np.pi, lambda a: 0.1 * np.sin(5 * a + 1), "cogging", "5 per turn"),
        ("reading_over_angle", 0, 2 * np.pi, lambda a: 0.1 * np.sin(2 * a + 1), "encoder_eccentricity", "2 per turn"),
        ("wandering_torque", 0, 60, lambda t: 0.3 - 0.01 * t, "drift", "steady"),
        ("wandering_torque", 0, 60, lambda t: np.sin(2 * np.pi * t / 20 + 1), "sine", "0.05 Hz"),
    ],
)
def test_known_laws_are_recognised(law, low, high, curve, name, text):
    at = np.linspace(low, high, 121)
    found = resemblances(BUILT_IN[law], at, curve(at), np.ones(121), np.zeros((121, 121)))
    assert found[0].name == name and found[0].similarity > 0.995 and text in found[0].text
    # A law that opposes the motion does not resemble one that drives it.
    if name not in ("direction_asymmetry", "voltage_offset", "cogging", "encoder_eccentricity", "drift", "sine"):
        turned = {
            one.name: one.similarity
            for one in resemblances(BUILT_IN[law], at, -curve(at), np.ones(121), np.zeros((121, 121)))
        }
        assert turned[name] == 0


@pytest.mark.parametrize("law", ["torque_over_speed", "torque_over_angle", "voltage_over_command", "wandering_torque"])
@pytest.mark.parametrize("low, high", [(200, 900), (1e-4, 2e-4)], ids=["high", "low"])
def test_shapes_of_which_next_to_nothing_shows_have_no_size(law, low, high):
    """As a friction that falls within 2 rad/s does at none of the speeds from 200 rad/s on."""
    at = np.linspace(low, high, 121)
    found = resemblances(BUILT_IN[law], at, -np.tanh(at / high), np.ones(121), 1e-4 * np.eye(121))
    assert all(np.isfinite([one.similarity, one.most, one.standard_error]).all() for one in found)
    assert all(one.most == 0 for one in found if one.similarity == 0)


def test_a_curve_is_like_nothing_larger_than_the_voltages_applied():
    at = np.linspace(100, 900, 121)
    shape = -8.0 * np.exp(-np.square(at / 850))
    bent = shape - np.polyval(np.polyfit(at, shape, 1), at)
    told = resemblances(TorqueOverSpeed, at, bent, np.ones(121), np.zeros((121, 121)))
    within = resemblances(TorqueOverSpeed, at, bent, np.ones(121), np.zeros((121, 121)), most=5.0)
    assert np.abs(bent).max() < 2.0
    assert max(one.most for one in told) > 5.0 >= max(one.most for one in within)
