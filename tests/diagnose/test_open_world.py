"""Laws that are in no vocabulary, hidden in plain numpy motion: learned over the right coordinate, in their shape."""

import dataclasses

import jax
import numpy as np
import pytest
from made import COUNTS, PERIOD, SCALE, SUPPLY, held, plan, sine

from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._learned_law import resemblances
from jaxmotor.diagnosis._solve import Solver
from jaxmotor.diagnosis._split import split
from jaxmotor.diagnosis._trial import trial_of
from jaxmotor.prediction import PADDED, pack
from jaxmotor.recording import Recording, Segment

RUNS = [*plan(), *(sine(f, amplitude=2.0) for f in (0.7037, 1.507, 3.011))]
GAIN, POLE, FINE = 11.0, 40.0, 5
LATE_S = 21.3


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


def hidden(law, seed, runs=RUNS):
    """A motor's recording with `law` [V] added to its voltage in every fifth of a tick, and (n, 2) speeds and volts.

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
        count = np.floor(np.array(angles) * COUNTS / (2 * np.pi) + offset).astype(np.int64)
        segments.append(Segment(kind, begin, True, parameters, tick * PERIOD, volts, tick=tick, count=count))
        begin += len(volts) * PERIOD + 0.5
    made = Recording(tuple(segments), "made.csv", PERIOD, COUNTS, float(SCALE), SUPPLY)
    return made, np.array(visited)


def fitted(recording):
    """A solver of the recording, and the linear motor that it fits."""
    with jax.enable_x64(True):
        packed = pack(recording, tuple(range(len(recording.segments))), PADDED)
        solver = Solver(trial_of(recording, packed, POLE))
        return solver, solver.fit(linear_of(GAIN, POLE), tolerance=1e-2)


def level(at, curve, visited):
    """`curve` at places `at` without the slope that it has over the `visited` places, and that slope."""
    x = visited - visited.mean()
    slope = float(x @ np.interp(visited, at, curve) / (x @ x))
    return curve - slope * at, slope


@pytest.fixture(scope="module")
def learned():
    found = {}
    for number, (name, law) in enumerate(LAWS.items()):
        recording, visited = hidden(law, number)
        found[name] = learn(recording, *fitted(recording)), visited
    return found


def check(law, true, size):
    error = law.volts - true
    assert np.ptp(true) == pytest.approx(size, rel=0.3)
    assert np.abs(error).max() < 0.1 * np.ptp(true)
    assert np.mean(np.abs(error) < 2 * law.standard_error) >= 0.9
    # A band is no excuse.
    assert np.median(law.standard_error) < 0.02 * np.ptp(true)


@pytest.mark.parametrize("coordinate", ["speed", "angle", "time", "voltage"])
def test_the_right_coordinate_comes_first(learned, coordinate):
    laws, _ = learned[coordinate]
    assert len(laws) == 4 and laws[0].coordinate == coordinate
    assert laws[0].share > 0.98 > laws[1].share + 0.005
    assert [law.share for law in laws] == sorted((law.share for law in laws), reverse=True)


def test_a_friction_that_is_in_no_vocabulary(learned):
    (law, *_), visited = learned["speed"]
    true, _ = level(law.at, over_speed(law.at), visited[:, 0])
    check(law, true, 0.3)
    assert law.resemblance == "like no known law" and law.jump is None


def test_a_bump_over_the_angle(learned):
    (law, *_), _ = learned["angle"]
    check(law, over_angle(law.at), 0.2)
    assert law.at[[0, -1]] == pytest.approx([0, 2 * np.pi]) and law.volts[0] == pytest.approx(law.volts[-1])


def test_a_load_that_appears(learned):
    (law, *_), _ = learned["time"]
    check(law, over_time(law.at), 0.25)
    assert law.jump == pytest.approx(LATE_S, abs=0.02)
    assert law.text == "a voltage that depends on the time, like a step at 21.3 s"


def test_a_drive_that_is_not_in_proportion(learned):
    (law, *_), visited = learned["voltage"]
    at = np.linspace(-SUPPLY, SUPPLY, 2001)
    true, slope = level(at, over_voltage(at), visited[:, 1])
    # The slope is the gain's, so that the curve is in volts of that gain.
    check(law, np.interp(law.at, at, true) / (1 + slope), 0.9)


def test_nothing_is_learned_where_nothing_is_hidden(learned):
    laws, _ = learned["nothing"]
    for law in laws:
        assert law.share < 0.02 and abs(law.gain) < 0.005 and law.resembles == ()
        assert np.abs(law.volts).max() < 3e-3 and law.text.startswith("nothing that depends on the ")


def test_learning_again_gives_the_same():
    recording, _ = hidden(LAWS["angle"], 1, RUNS[:6])
    solver, motor = fitted(recording)
    first, second = learn(recording, solver, motor), learn(recording, solver, motor)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.volts, other.volts)
        assert one.share == other.share and one.resembles == other.resembles


def test_a_recording_of_one_run_is_held_out_in_parts():
    """No angle over a turn, few voltages, one segment: what is left to learn from is learned from."""
    volts = held(np.repeat(np.random.default_rng(0).choice([-5.1, 2.0, 5.1], 120), 9))
    recording, _ = hidden(lambda volts, speed, angle, time: 0.3 * np.sin(2 * time), 3, [("prbs", {}, volts)])
    segment = dataclasses.replace(recording.segments[0], at_rest=False)
    recording = dataclasses.replace(recording, segments=(segment,))
    solver, motor = fitted(recording)
    out = held_rows(recording, solver)
    assert out.mean() == pytest.approx(1 / 3, abs=0.01) and (np.diff(np.flatnonzero(out)) == 1).all()
    laws = learn(recording, solver, motor)
    assert laws[0].coordinate == "time" and "voltage" not in {law.coordinate for law in laws}
    inner = slice(5, -5)
    np.testing.assert_allclose(laws[0].volts[inner], 0.3 * np.sin(2 * laws[0].at[inner]), atol=0.03)


def test_a_few_rows_teach_nothing():
    recording, _ = hidden(LAWS["nothing"], 0, [("step", {}, np.full(150, held(5.1)))])
    assert learn(recording, *fitted(recording)) == ()


def test_held_rows_are_those_of_the_split():
    recording, _ = hidden(LAWS["nothing"], 0, RUNS[6:12])
    solver, _ = fitted(recording)
    parts, segments = split(recording)
    assert parts is not recording and segments, "two sines outweigh the rest"
    number = sum(len(parts.segments[k]) - 1 for k in segments)
    assert held_rows(recording, solver).sum() == pytest.approx(number, abs=2 * len(segments))


@pytest.mark.parametrize("turn", [False, True])
def test_splines_hold_what_they_must(turn):
    """Any spline adds up to one where all coefficients are one; roughness is that of the curve, by differences."""
    at = np.sort(np.random.default_rng(1).normal(size=400))
    spline = Spline(np.linspace(0, 2 * np.pi, 32), turn=True) if turn else spline_over(at)
    at = np.mod(at, 2 * np.pi) if turn else at
    columns = spline.columns(at)
    np.testing.assert_allclose(columns.sum(1), 1, atol=1e-12)
    assert (columns >= 0).all() and (columns > 0).sum(1).max() == 4
    assert np.ones(columns.shape[1]) @ spline.roughness() @ np.ones(columns.shape[1]) == pytest.approx(0, abs=1e-12)
    if not turn:
        from scipy.interpolate import BSpline

        whole = np.concatenate([[spline.knots[0]] * 3, spline.knots, [spline.knots[-1]] * 3])
        np.testing.assert_allclose(columns, BSpline.design_matrix(at, whole, 3).toarray(), atol=1e-12)
        line = np.linalg.lstsq(columns, at)[0]
        assert line @ spline.roughness() @ line == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("coordinate", "low", "high", "curve", "name", "text"),
    [
        ("speed", -50, 50, lambda w: 0.3 - 0.2 * np.sign(w) + 0.01 * w, "coulomb_friction", "Coulomb"),
        ("speed", -50, 50, lambda w: -1e-4 * w * np.abs(w) + 0.02 * w, "quadratic_drag", "squared"),
        ("voltage", -6, 6, lambda u: -np.clip(u, -0.5, 0.5) + 0.1 * u, "dead_zone", "0.5 V"),
        ("voltage", -6, 6, lambda u: -np.where(np.abs(u) < 1, u, 0), "input_threshold", "1 V"),
        ("voltage", -6, 6, lambda u: np.clip(u, -4.5, 4.5) - u, "voltage_saturation", "4.5 V"),
        ("voltage", -6, 6, lambda u: -0.05 * np.abs(u), "direction_asymmetry", "one way"),
        ("voltage", -6, 6, lambda u: 0.2 + 0 * u, "voltage_offset", "offset"),
        ("angle", 0, 2 * np.pi, lambda a: 0.1 * np.sin(5 * a + 1), "cogging", "5 per turn"),
        ("time", 0, 60, lambda t: 0.3 - 0.01 * t, "drift", "steady"),
        ("time", 0, 60, lambda t: np.sin(2 * np.pi * t / 20 + 1), "sine", "0.05 Hz"),
    ],
)
def test_known_laws_are_recognised(coordinate, low, high, curve, name, text):
    at = np.linspace(low, high, 121)
    found = resemblances(coordinate, at, curve(at), np.ones(121), None)
    assert found[0].name == name and found[0].similarity > 0.995 and text in found[0].text
    # A law that opposes the motion does not resemble one that drives it.
    if name not in ("direction_asymmetry", "voltage_offset", "cogging", "drift", "sine"):
        turned = {one.name: one.similarity for one in resemblances(coordinate, at, -curve(at), np.ones(121), None)}
        assert turned[name] == 0
