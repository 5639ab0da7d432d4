"""How the speeds of a log were averaged, where its header does not state it: a property of the log, with its error."""

import dataclasses
import json
import math
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from real_data import FOLDER, measured
from speed_logs import Result, results, speed_log

from jaxmotor import JaxmotorError, identify
from jaxmotor.estimate import SpeedAverage, Timing, stated, to_json
from jaxmotor.estimate._averaging import OF_LOG, packed_for_average
from jaxmotor.estimate._trajectory import MAX_STEPS, solve
from jaxmotor.motor import SecondOrder, simulate
from jaxmotor.prediction import LAG_S, NONE_ROWS, Reading, as_problem, is_no_average, observe, pack
from jaxmotor.recording import Recording, Segment


def log_of(seen, seed=1):
    return speed_log(np.random.default_rng([5, seed]), seen)


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("late_rows", [-0.4, 0.3])
@pytest.mark.parametrize("rows", [0.6, 1.0, 3.7, 19.2])
def test_a_window_of_any_length_is_exact(rows, late_rows, uneven):
    """Against the same motion in parts of a row; behind it what was before the first row, which is rest."""
    period, parts, number = 0.01, 100, 50
    rng = np.random.default_rng(2)
    steps = rng.integers(60, 200, number) if uneven else np.full(number, parts)
    at, volts = np.concatenate([[0], np.cumsum(steps)]), rng.normal(size=number)
    volts[0] = 0.0
    fine, window, late = period / parts, round(rows * parts), round(late_rows * parts)
    with jax.enable_x64(True):
        motor = SecondOrder(*(jnp.asarray(value) for value in (10.0, 30.0, 4e-3)))
        begins = np.arange(at[-1] + 2 * parts) == 0
        drive = np.concatenate([np.zeros(parts), np.repeat(volts, steps), np.full(parts, volts[-1])])
        moved = simulate(motor, *map(jnp.asarray, (drive, begins, np.zeros(len(drive)), fine)))
        angle = np.concatenate([np.zeros(window), np.cumsum(moved.turn) - moved.turn])
        # Voltages that act late are read as if rows came early.
        when = at[:-1] + parts - late
        expected = (angle[when + window] - angle[when]) / (window * fine)
        segment = Segment("other", 0.0, True, {}, at[:-1] * fine, volts, speed_rad_s=np.arange(float(number)))
        if not uneven:
            segment = dataclasses.replace(segment, tick=np.arange(number))
        recording = Recording((segment,), "made.csv", period_s=None if uneven else period)
        held = np.array([False] * 6)
        problem = as_problem(pack(recording, (0,)), True, held)
        reading = Reading(jnp.asarray(late * fine), jnp.asarray(window * fine))
        still = jnp.zeros(problem.batch.volts.shape)
        seen = observe(motor, problem, jnp.asarray(problem.batch.volts), still, reading) * problem.unit
    np.testing.assert_allclose(np.asarray(seen)[0, :number], expected, atol=1e-8)


@pytest.mark.parametrize("seen", ["window", "uneven"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_window_is_the_logs_and_gain_and_pole_are_as_if_it_were_stated(seen, seed):
    log = log_of(seen, seed)
    fit, known = identify(log.unstated), identify(log.recording)
    found = fit.average
    assert found is not None and found.kind == "window" and found.separable and fit.timing is None
    assert abs(found.length_s - log.length_s) < min(3 * found.standard_error_s, 0.05 * log.length_s)
    for name in ("gain", "pole"):
        error = abs(float(getattr(fit.motor, name)) - getattr(log, name))
        assert error < 3 * float(getattr(fit.standard_error, name))
    assert float(fit.standard_error.gain) < 2 * float(known.standard_error.gain)
    assert fit.chi2_per_sample == pytest.approx(known.chi2_per_sample, rel=0.05)
    [note] = [note for note in fit.notes if "property of the log" in note]
    assert "means over" in note and len(note) < 300
    assert not any("it is not known over how long" in note for note in fit.notes)
    told = json.loads(json.dumps(to_json(fit)))["speed_average"]
    assert told["kind"] == "window" and told["length_s"] == found.length_s
    assert stated(log.unstated, found).speed_window_s == pytest.approx(found.length_s, rel=1e-4)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_filter_is_found_and_the_slower_of_two_lags_is_the_motors(seed):
    log = log_of("filter", seed)
    fit = identify(log.unstated)
    assert fit.average is not None and fit.average.kind == "filter"
    slow, fast = sorted((1 / log.pole, log.length_s), reverse=True)
    assert abs(fit.average.length_s - fast) < 3 * fit.average.standard_error_s < 0.3 * fast
    assert abs(float(fit.motor.pole) - 1 / slow) < 3 * float(fit.standard_error.pole)
    assert "filter" in "".join(fit.notes)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_window_of_one_row_and_half_of_it_too_early_are_said_to_be_the_same(seed):
    log = log_of("one row", seed)
    found = identify(log.unstated).average
    assert found is not None and not found.separable
    assert abs(found.lateness_s - log.length_s / 2) < 3 * found.lateness_error_s < 0.1 * log.length_s
    assert "the two look the same" in found.sentence


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_none_is_found_where_speeds_are_instantaneous_or_the_header_states_the_window(seed):
    assert identify(log_of("instantaneous", seed).unstated).average is None
    assert identify(log_of("window", seed).recording).average is None


def test_a_pole_that_an_unknown_average_hides_is_refused_in_a_sentence_that_says_how_long_it_is():
    """A motor that follows at once, its speeds means over 14 rows."""
    rng, rows, window, period = np.random.default_rng(4), 2000, 14, 0.008
    volts = np.repeat(rng.uniform(-10.0, 10.0, rows // 40), 40)
    turned = np.cumsum(np.concatenate([np.zeros(window), 5.0 * volts]))
    speed = np.concatenate([[0.0], (turned[window:] - turned[:-window])[:-1] / window])
    speed += rng.normal(0, 0.2, rows)
    segment = Segment("other", 0.0, True, {}, period * np.arange(rows), volts, np.arange(rows), speed_rad_s=speed)
    with pytest.raises(JaxmotorError, match="pole is not determined") as refused:
        identify(Recording((segment,), "a_long_name_of_a_file_that_somebody_has.csv", period))
    [length] = re.findall(r"\(over (\S+) ms fits best\)", str(refused.value))
    assert float(length) == pytest.approx(1e3 * window * period, rel=0.02)
    assert "--speed-window" in str(refused.value) and " ... " not in str(refused.value)


@pytest.mark.parametrize("way", ["window", "filter"])
def test_a_fit_ends_where_an_average_comes_to_none(way, x64):
    """Of speeds that are a row early, which is the opposite of an average: its logarithm would go on for ever."""
    log = log_of("instantaneous")
    noise = pack(log.unstated, (0,)).observation.noise
    packed = packed_for_average(log.unstated, (0,), noise)
    held = np.array([False] * 3 + [name != way for name in OF_LOG])
    problem = as_problem(packed, True, held)
    start = np.array([log.gain, 0.0, *np.log([log.pole, 4 * packed.durations[0], 4.0]), 0.0])
    start[3 + (way == "filter")] = math.log(NONE_ROWS if way == "filter" else LAG_S[0])
    early = dataclasses.replace(problem, batch=packed.batch._replace(observed=np.roll(packed.batch.observed, -1)))
    solution, _ = solve(early, jnp.asarray(start))
    assert int(solution.steps) < MAX_STEPS / 2
    assert bool(is_no_average(solution.psi, early)) and not bool(is_no_average(jnp.asarray(start), early))


def test_what_may_be_none_is_not_told_as_a_fact():
    found = SpeedAverage("filter", 4.5e-3, 15e-3, 4.5e-3, 15e-3, True, 0.0, 0.0)
    assert "may have gone through a first-order filter, of no more than 34 ms" in found.sentence
    sure = dataclasses.replace(found, standard_error_s=1e-3)
    assert "went through a first-order filter of 4.5" in sure.sentence
    assert "rows are read between 4.8 ms before and 13 ms after" in Timing(4e-3, 4.5e-3).sentence
    assert "rows are read 4 ± 0.98 ms after" in Timing(4e-3, 0.5e-3).sentence


@pytest.mark.parametrize("seen", ["instantaneous", "window", "filter"])
def test_intervals_hold_beside_what_is_estimated_of_the_log(seen):
    """20 motors: fewer than 15 gains or poles inside their 95 % intervals would come once in three thousand times."""
    found = [one for one in results(20, 33, seen, stated=False) if isinstance(one, Result)]
    assert len(found) == 20
    assert (np.abs([one.z for one in found]) < 1.96).sum(axis=0).min() >= 15
    assert sum(math.isfinite(one.length) and abs(one.length - 1) < 0.05 for one in found) >= 15


@pytest.mark.skipif(not FOLDER.is_dir(), reason="no measured logs; name their folder with JAXMOTOR_DATA")
def test_window_and_offset_of_a_measured_log():
    """Count differences over 20 ms, of which the log says nothing."""
    fit = identify(dataclasses.replace(measured("brake/prbs_open"), speed_window_s=None))
    assert fit.average is not None and fit.timing is not None
    assert abs(fit.average.length_s - 0.02) < 1.96 * fit.average.standard_error_s < 2e-3
    assert fit.timing.offset_s == pytest.approx(-8.5e-3, abs=1e-3)
    assert fit.fit_percent > 96


@pytest.mark.skipif(not FOLDER.is_dir(), reason="no measured logs; name their folder with JAXMOTOR_DATA")
def test_a_measured_step_alone_tells_its_window_and_the_pole():
    """Of the same motor a long PRBS says 26.7 +- 0.3 rad/s."""
    fit = identify(dataclasses.replace(measured("brake/step_open"), speed_window_s=None))
    assert fit.average is not None
    assert abs(fit.average.length_s - 0.02) < 1.96 * fit.average.standard_error_s < 5e-3
    assert abs(float(fit.motor.pole) - 26.7) < 1.96 * float(fit.standard_error.pole) < 3
