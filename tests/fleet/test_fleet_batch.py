"""A batch gives what `identify` gives, motor by motor, whatever their plans."""

import dataclasses

import numpy as np
import pytest
from fleets import SHORT, recording, short, sine, step, with_lost_ticks
from testing.made import with_friction

import jaxmotor as jm
from jaxmotor.fleet import Options, _identify_part, fit_friction, identify_batch, ready
from jaxmotor.fleet._dataset import Part
from jaxmotor.fleet._identify_part import identify_part


def assert_same(found, fit):
    assessed = found.assessment
    for name in ("gain", "pole"):
        assert float(getattr(assessed.motor, name)) == pytest.approx(float(getattr(fit.motor, name)), rel=1e-6)
        error = float(getattr(fit.standard_error, name))
        assert float(getattr(assessed.standard_error, name)) == pytest.approx(error, rel=1e-6)
    assert assessed.offset_V == pytest.approx(fit.offset_V, rel=1e-5, abs=1e-9)
    assert found.chi2_per_sample == pytest.approx(fit.chi2_per_sample, rel=1e-6)
    assert found.fit_percent == pytest.approx(fit.fit_percent, abs=1e-6)
    assert found.notes == fit.notes


@pytest.mark.parametrize("change", ["none", "lost", "friction", "wander"])
def test_equal_to_identify(change):
    rng = np.random.default_rng(3)
    makes = {
        "none": lambda seed: short(seed, gain=9.0 + seed, pole=30.0 + 5 * seed),
        "lost": lambda seed: with_lost_ticks(short(seed, gain=9.0 + seed), rng),
        "friction": lambda seed: short(seed, friction=0.1 + 0.1 * seed),
        "wander": lambda seed: short(seed, wander=0.05),
    }
    recordings = [makes[change](seed) for seed in range(3)]
    motors = [ready(each) for each in recordings]
    assert len({motor.key for motor in motors}) == 1
    for found, each in zip(identify_batch(motors), recordings, strict=True):
        assert_same(found, jm.identify(each))


def test_equal_to_identify_without_sines():
    given = recording(4, runs=[step(5.0, 200), step(-3.0, 150), step(4.0, 171)])
    [found] = identify_batch([ready(given)])
    assert_same(found, jm.identify(given))


def test_one_motor_that_says_nothing_is_a_sentence_among_good_ones():
    good = short(1)
    still = dataclasses.replace(
        good, segments=tuple(dataclasses.replace(s, volts=s.volts * 0, count=s.count) for s in good.segments)
    )
    with pytest.raises(jm.JaxmotorError, match="0 V throughout"):
        ready(still)
    # Steps so long after one another that the pole is never seen: only slow ramps of voltage.
    runs = [sine(0.31, 240), sine(0.77, 240), sine(1.3, 240), *SHORT[3:]]
    motors = [ready(recording(2, pole=4000.0, runs=runs)), ready(recording(3, runs=runs))]
    assert motors[0].key == motors[1].key
    bad, fine = identify_batch(motors)
    assert isinstance(bad, jm.JaxmotorError) and "pole is not determined" in str(bad)
    assert not isinstance(fine, jm.JaxmotorError)


def test_friction_and_dead_zone_are_found():
    """Friction alone: a dead zone of zero is the edge of what can be fitted, so the sum is what is known best."""
    sizes = (0.1, 0.25, 0.4)
    recordings = [recording(30 + k, friction=size) for k, size in enumerate(sizes)]
    motors = [ready(each) for each in recordings]
    for size, fit in zip(sizes, fit_friction(motors, identify_batch(motors)), strict=True):
        assert fit is not None
        assert fit.friction_V == pytest.approx(size, abs=4 * fit.standard_error[2])
        assert fit.dead_zone_V < 4 * fit.standard_error[3]
        assert fit.friction_V + fit.dead_zone_V == pytest.approx(size, abs=3e-4)
        assert fit.gain == pytest.approx(11.0, abs=4 * fit.standard_error[0])
        assert fit.pole == pytest.approx(40.0, abs=4 * fit.standard_error[1])
        assert fit.chi2_per_sample < 1.05


def test_a_dead_zone_is_told_from_friction(monkeypatch):
    def both(volts, gain, pole, friction):
        return with_friction(np.sign(volts) * np.maximum(np.abs(volts) - 0.3, 0), gain, pole, friction)

    monkeypatch.setattr("testing.made.with_friction", both)
    motors = [ready(recording(40, friction=0.15))]
    [fit] = fit_friction(motors, identify_batch(motors))
    assert fit is not None and fit.chi2_per_sample < 1.05
    assert fit.friction_V == pytest.approx(0.15, abs=4 * fit.standard_error[2])
    assert fit.dead_zone_V == pytest.approx(0.3, abs=4 * fit.standard_error[3])


def test_a_part_keeps_the_order_and_the_bad(tmp_path):
    for name, seed in (("b", 1), ("a", 2), ("d", 3)):
        jm.write(short(seed), tmp_path / f"{name}.csv")
    (tmp_path / "c.csv").write_text("hello\n")
    files = tuple(str(tmp_path / f"{name}.csv") for name in "abcd")
    rows = identify_part(Part(files, None), Options())
    assert [row["motor"] for row in rows] == ["a", "b", "c", "d"]
    assert [row["problem"] is None for row in rows] == [True, True, False, True]
    assert "not a recording" in rows[2]["problem"]


@pytest.mark.parametrize("step_of_it", ["start_batch", "results_of"])
def test_a_batch_that_fails_is_done_motor_by_motor(tmp_path, monkeypatch, step_of_it):
    for name, seed in (("a", 1), ("b", 2), ("c", 3)):
        jm.write(short(seed), tmp_path / f"{name}.csv")
    part = Part(tuple(str(tmp_path / f"{name}.csv") for name in "abc"), None)
    expected = identify_part(part, Options())
    whole = getattr(_identify_part, step_of_it)

    def fails(given, *rest):
        motors = given if isinstance(given, list) else given.motors
        if len(motors) > 1 or "b.csv" in motors[0].prepared.recording.source:
            raise MemoryError("too much")
        return whole(given, *rest)

    monkeypatch.setattr(_identify_part, step_of_it, fails)
    rows = identify_part(part, Options())
    assert "MemoryError" in rows[1]["problem"]
    assert [rows[0], rows[2]] == [expected[0], expected[2]]
