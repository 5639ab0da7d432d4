"""The noise of logs without counts: the grid that their readings lie on, and what no motor explains."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.signal import lfilter
from speed_logs import Result, results, speed_log

from jaxmotor.estimate import identify, to_json
from jaxmotor.prediction import PADDED, pack
from jaxmotor.prediction._noise import grid_step
from jaxmotor.recording import Recording, Segment

COUNT = 2 * np.pi / 1200


def turned(rows=2000):
    """A motion that goes on in one direction, now faster and now slower."""
    return np.cumsum(0.04 + 0.03 * np.sin(0.1 * np.arange(rows)))


def test_an_encoder_that_never_comes_back_is_found():
    """Each value is seen once or twice; the text has nine digits of radians."""
    angle = np.round(np.floor(turned() / COUNT) * COUNT, 9)
    assert grid_step(angle) == pytest.approx(COUNT, rel=1e-6)


@pytest.mark.parametrize("digits", [4, 5, 6])
def test_speeds_from_counts_written_with_few_digits_are_found(digits):
    """Far multiples of the step are rounded by more than the step's own last digit."""
    step = 0.4601942
    speeds = step * np.random.default_rng(digits).integers(-400, 400, 3000)
    written = np.array([float(f"{speed:.{digits}g}") for speed in speeds])
    assert grid_step(written) == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize("place", [1e-3, 2e-3, np.radians(0.05), 2e-4 * np.pi])
def test_decimals_are_no_encoder(place):
    """A noise of thirty steps, written with so many digits."""
    noise = 30 * place * np.random.default_rng(0).standard_normal(2000)
    smooth = 400 * place * np.arange(2000)
    assert grid_step(np.round((smooth + noise) / place) * place) is None


def test_decimals_that_come_again_are_one():
    assert grid_step(np.round(np.sin(0.1 * np.arange(3000)), 2)) == pytest.approx(0.01, rel=1e-6)


def test_values_without_a_grid_have_none():
    assert grid_step(turned() + 1e-3 * np.random.default_rng(1).standard_normal(2000)) is None


def noise_of(recording):
    noise = pack(recording, (0,)).observation.noise
    assert noise is not None
    return noise


def test_the_noise_of_a_log_does_not_depend_on_where_its_segments_are_placed():
    """Of a log whose speed sags in its course, with segments of any length."""
    log = speed_log(np.random.default_rng(3), "instantaneous", 2000).recording
    [whole] = log.segments
    cuts = [0, 130, 500, 650, 1400, 1500, 2000]
    parts = []
    sagging = whole.speed_rad_s * (1 - 2e-4 * np.arange(len(whole)))
    for begin, end in itertools.pairwise(cuts):
        own, tick = slice(begin, end), np.arange(end - begin)
        columns = {"time_s": whole.time_s[tick], "tick": tick, "volts": whole.volts[own], "speed_rad_s": sagging[own]}
        parts.append(dataclasses.replace(whole, **columns))
    log, every = dataclasses.replace(log, segments=tuple(parts)), tuple(range(len(parts)))
    paddings = (None, PADDED, PADDED._replace(sequences=1), PADDED._replace(sequences=3))
    found = [pack(log, every, padding).observation.noise for padding in paddings]
    assert all(noise == found[0] for noise in found)


@pytest.mark.parametrize("seen", ["instantaneous", "one row", "window", "uneven", "filter"])
def test_the_noise_of_speeds_is_found(seen):
    found = []
    for seed in range(12):
        log = speed_log(np.random.default_rng([20, seed]), seen)
        found.append(noise_of(log.recording).level / log.noise)
    assert np.median(found) == pytest.approx(1, abs=0.06)
    assert np.quantile(found, 0.1) > 0.8 and np.quantile(found, 0.8) < 1.2


def filtered(weights, keep, values):
    """y_k = keep y_{k-1} + the sum of `weights` times the last `values`."""
    return np.asarray(lfilter(weights, [1.0, -keep], values))


def made(speed, volts, **more):
    period = 0.01
    tick = np.arange(len(volts))
    segment = Segment("other", 0.0, True, {}, period * tick, volts, tick=tick, speed_rad_s=speed)
    return Recording((segment,), "made", period, speed_window_s=0.0, supply_V=12.0, **more)


def rubbing(rng, rows=4000, friction=0.6):
    """Speeds [rad/s] of a motor with Coulomb friction, finely integrated, that stands still at times."""
    volts = np.repeat(rng.uniform(-2, 2, rows // 40), 40)
    volts[:40] = 0.0
    speed, now, fine, gain, pole = [], 0.0, 50, 10.0, 20.0
    for volt in volts:
        speed.append(now)
        for _ in range(fine):
            free = now + 0.01 / fine * pole * (gain * volt - now)
            drag = 0.01 / fine * pole * gain * friction
            now = np.sign(free) * max(abs(free) - drag, 0.0)
    return np.array(speed), volts


@pytest.mark.parametrize("friction", [0.1, 0.6])
def test_friction_does_not_add_to_the_noise(friction):
    speed, volts = rubbing(np.random.default_rng(0), friction=friction)
    noise = 0.07 * speed.std()
    noisy = speed + noise * np.random.default_rng(1).standard_normal(len(speed))
    assert noise_of(made(noisy, volts)).level == pytest.approx(noise, rel=0.1)


def test_without_noise_friction_leaves_little():
    """What the flexible model cannot do: the moments within a row at which the motor stops and starts."""
    speed, volts = rubbing(np.random.default_rng(0))
    linear = identify(made(speed, volts))
    assert noise_of(made(speed, volts)).level < 0.03 * speed.std() and linear.chi2_per_sample > 10


def test_rest_and_readings_held_do_not_hide_the_noise():
    """The sensor's noise shows where it turns only, and its last reading stands 400 rows."""
    speed, volts = rubbing(np.random.default_rng(2))
    noise = 0.07 * speed.std()
    noisy = np.where(speed == 0, 0.0, speed + noise * np.random.default_rng(3).standard_normal(len(speed)))
    held = [np.append(noisy, np.full(400, noisy[-1])), np.append(volts, np.full(400, volts[-1]))]
    assert noise_of(made(*held)).level == pytest.approx(noise, rel=0.1)


def test_the_colour_is_told():
    rng = np.random.default_rng(4)
    volts = np.repeat(rng.uniform(-5, 5, 200), 20)
    speed = filtered([0.0, 1.0], 0.8, 2.0 * volts)
    white = rng.standard_normal(len(volts))
    coloured = noise_of(made(speed + filtered([0.1], 0.9, white), volts))
    assert coloured.row_to_row == pytest.approx(0.1, rel=0.1)
    assert coloured.level == pytest.approx(0.1 / np.sqrt(1 - 0.81), rel=0.15)
    assert coloured.rows_per_reading == pytest.approx(19, rel=0.5)
    assert noise_of(made(speed + 0.1 * white, volts)).rows_per_reading == pytest.approx(1, abs=0.3)


def test_the_step_of_speeds_is_the_least_noise():
    rng = np.random.default_rng(5)
    volts = np.repeat(rng.uniform(-5, 5, 200), 20)
    speed = filtered([0.0, 1.0], 0.8, 2.0 * volts)
    noise = noise_of(made(0.7 * np.round(speed / 0.7), volts))
    assert noise.step == pytest.approx(0.7) and noise.level == pytest.approx(0.7 / np.sqrt(12), rel=0.05)


def test_json_tells_it_in_the_logs_unit():
    [segment] = speed_log(np.random.default_rng(6), "instantaneous").recording.segments
    logs = [
        made(segment.speed_rad_s, segment.volts, header=header) for header in ({}, {"imported": {"speed": "w:rpm"}})
    ]
    plain, imported = (to_json(identify(log))["noise"] for log in logs)
    assert plain["unit"] == "rad/s" and plain["level"] == plain["level_rad_s"] == imported["level_rad_s"]
    assert imported["unit"] == "rpm"
    assert imported["level"] == pytest.approx(plain["level"] * 60 / (2 * np.pi))


@pytest.mark.parametrize("seen", ["instantaneous", "window", "uneven"])
def test_intervals_of_speed_logs_hold(seen):
    """40 motors: fewer than 33 gains or poles inside their 95 % intervals would come once in a thousand times."""
    found = [one for one in results(40, 21, seen) if isinstance(one, Result)]
    assert len(found) == 40
    inside = (np.abs([one.z for one in found]) < 1.96).sum(axis=0)
    assert inside.min() >= 33
    assert np.median([one.chi2 for one in found]) == pytest.approx(1, abs=0.03)
