"""Laws that are locked to the shaft's angle, in logs that hold its speed alone, or no angle from segment to segment."""

import dataclasses

import numpy as np
import pytest

from jaxmotor import diagnose
from jaxmotor.diagnosis._diagnose import BEGINS
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._segment_angles import with_angles
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects import AbstractEffect, Cogging, Rig
from jaxmotor.prediction import shaft_angles
from jaxmotor.recording import Recording, Segment

GAIN, POLE, PERIOD_S, ROWS, STEPS = 6.0, 12.0, 0.01, 4000, 50
COGGING_V, CYCLES, ECCENTRIC_RAD = 0.25, 6, 0.02
SHOWN_ROWS, COUNTS_PER_REV = 3, 2000.0


def speed_log(seed: int, cogging_V: float = 0.0, eccentric_rad: float = 0.0) -> tuple[Recording, np.ndarray]:
    """Random voltages, Euler's method in steps of 0.2 ms; means over three rows, and the true angle at each row."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-6, 6, ROWS), rng.integers(5, 120, ROWS))[:ROWS]
    step = PERIOD_S / STEPS
    angle, now = np.zeros(ROWS * STEPS + 1), 0.0
    for k in range(ROWS * STEPS):
        now += step * POLE * (GAIN * (volts[k // STEPS] - cogging_V * np.sin(CYCLES * angle[k] + 0.7)) - now)
        angle[k + 1] = angle[k] + step * now
    read = angle + eccentric_rad * np.sin(angle + 0.3)
    at = np.arange(ROWS) * STEPS
    window_s = SHOWN_ROWS * PERIOD_S
    speed = (read[at] - read[np.maximum(at - SHOWN_ROWS * STEPS, 0)]) / window_s
    speed = speed + 0.003 * speed.std() * rng.standard_normal(ROWS)
    segment = Segment("other", 0.0, True, {}, np.arange(ROWS) * PERIOD_S, volts, np.arange(ROWS), speed_rad_s=speed)
    made = Recording((segment,), "speeds", PERIOD_S, speed_window_s=window_s, supply_V=6.0, duty_delay_s=0.0)
    return made, angle[at]


@pytest.fixture(scope="module")
def smooth() -> tuple[Recording, np.ndarray]:
    return speed_log(1)


def test_the_angle_is_the_integral_of_means_half_a_window_later(smooth):
    made, truth = smooth
    angles = shaft_angles(made)
    assert angles is not None
    off = angles[0] - truth
    # Noise of 0.06 rad/s in 4000 rows of 10 ms adds up to 0.04 rad.
    assert np.ptp(truth) > 4 * np.pi and np.abs(off - off.mean()).max() < 0.12
    early = shaft_angles(dataclasses.replace(made, speed_window_s=None))
    assert early is not None
    assert np.std(early[0] - truth) > 2 * np.std(off)


def test_there_is_no_angle_across_what_is_not_in_the_log(smooth):
    made, _ = smooth
    [run] = made.segments
    assert run.tick is not None
    lost = dataclasses.replace(run, tick=run.tick + (run.tick > 500))
    assert shaft_angles(dataclasses.replace(made, segments=(lost,))) is None
    assert shaft_angles(dataclasses.replace(made, segments=(run, run))) is None


def counted(made: Recording, angle_rad: np.ndarray) -> Recording:
    """The log of a counter in the place of that of speeds `made`."""
    [run] = made.segments
    count = np.floor(angle_rad * COUNTS_PER_REV / (2 * np.pi)).astype(np.int64)
    run = dataclasses.replace(run, count=count, speed_rad_s=None)
    return dataclasses.replace(made, segments=(run,), counts_per_rev=COUNTS_PER_REV, speed_window_s=None)


def cut(made: Recording, parts: int) -> Recording:
    """`made` in parts; the last 80 rows of each, in which the shaft turns on, are not in the log."""
    [run] = made.segments
    length = ROWS // parts
    pieces = [slice(part * length, (part + 1) * length - 80) for part in range(parts)]
    segments = [
        Segment(
            *("other", float(run.time_s[piece.start]), False, {}, run.time_s[: length - 80], run.volts[piece]),
            np.arange(length - 80),
            count=None if run.count is None else run.count[piece] - run.count[piece.start],
            speed_rad_s=None if run.speed_rad_s is None else run.speed_rad_s[piece],
        )
        for piece in pieces
    ]
    return dataclasses.replace(made, segments=tuple(segments), count_resets=True)


@pytest.mark.parametrize("measured", ["speed", "count"])
def test_segments_whose_angles_are_not_known_are_put_together(measured):
    made, angle_rad = speed_log(3, cogging_V=COGGING_V)
    log = cut(made if measured == "speed" else counted(made, angle_rad), 4)
    found = diagnose(log, effects=["cogging", "encoder_eccentricity", "coulomb_friction", "transport_delay"])
    [effect] = found.named
    assert effect.name == "cogging"
    # What the phases are off by is more than the rounding of counts: drift chi2 falls from 461 to 1.19.
    assert found.verdict == ("extended" if measured == "speed" else "unexplained")
    assert found.held_out.drift_after < 0.01 * found.held_out.drift_before + 1
    assert round(effect.parameters["cycles_per_rev"]) == CYCLES
    assert abs(effect.parameters["volts_V"] - COGGING_V) < 3 * effect.standard_error["volts_V"] < 0.1 * COGGING_V
    assert BEGINS in found.notes


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("seed", range(4))
def test_noise_puts_no_segments_together(seed):
    study = study_of(cut(speed_log(10 + seed)[0], 3 + seed), POLE)
    assert with_angles(study, study.solver.fit(linear_of(GAIN, POLE))) is None


class OneWave(Cogging):
    """A user's own: one number of cycles, from one start."""

    name = "one_wave"

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return Cogging.starts(rig)[2 * CYCLES - 2 : 2 * CYCLES - 1]


@pytest.mark.usefixtures("x64")
def test_a_wave_that_nothing_can_be_compared_with_puts_no_segments_together():
    made, _ = speed_log(3, cogging_V=COGGING_V)
    study = study_of(cut(made, 4), POLE, request=Request([OneWave]))
    assert with_angles(study, study.solver.fit(linear_of(GAIN, POLE))) is None
    everything = study_of(cut(made, 4), POLE)
    assert with_angles(everything, everything.solver.fit(linear_of(GAIN, POLE))) is not None


@pytest.mark.parametrize(
    ("hidden", "name", "size", "truth"),
    [
        ({"cogging_V": COGGING_V}, "cogging", "volts_V", COGGING_V),
        ({"eccentric_rad": ECCENTRIC_RAD}, "encoder_eccentricity", "amplitude_rad", ECCENTRIC_RAD),
    ],
)
def test_what_is_locked_to_the_angle_is_named_with_its_size(hidden, name, size, truth):
    found = diagnose(speed_log(2, **hidden)[0])
    [effect] = found.named
    assert effect.name == name and found.verdict == "extended"
    assert round(effect.parameters["cycles_per_rev"]) == (CYCLES if name == "cogging" else 1)
    assert abs(effect.parameters[size] - truth) < 3 * effect.standard_error[size] < 0.1 * truth
    assert abs(float(found.motor.linear.gain) - GAIN) < 3 * found.standard_error["gain_rad_s_V"] + 0.001 * GAIN
