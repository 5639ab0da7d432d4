"""The C header: compiles cleanly for board and host, computes what `jaxmotor.control` says, and closes the loop."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from exported_loop import run
from hypothesis import given
from hypothesis import strategies as st
from testing.exported import FLAGS, Header, Plant, draw, on_board

from jaxmotor import JaxmotorError
from jaxmotor._precision import in_float64, to_jax
from jaxmotor.control import Hardware, estimate_motion, feed_forward
from jaxmotor.motor import EFFECTS, linear_motor
from jaxmotor.present.exports import design, to_c
from jaxmotor.present.exports._fixed_point import times

needs_cc = pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler; apt install build-essential")


def with_effects(drawn, *effects, lag=None):
    """The drawn model with other effects."""
    import dataclasses

    made = in_float64(lambda: tuple(EFFECTS[name].of(**values) for name, values in effects))()
    motor = drawn.model.motor if lag is None else linear_motor([10.6, 40.0, lag])
    covariance = drawn.model.covariance if lag is None else np.diag([1e-3, 0.1, 1e-8])
    return dataclasses.replace(drawn.model, motor=motor, covariance=covariance, effects=made, effect_errors=())


ALL = (
    ("coulomb_friction", {"volts_V": 0.3}),
    ("dead_zone", {"volts_V": 0.2}),
    ("direction_asymmetry", {"ratio": 0.05}),
    ("quadratic_drag", {"volts_V_s2_rad2": 4e-4}),
    ("load_torque", {"volts_V": 0.2}),
    ("transport_delay", {"delay_s": 0.012}),
)


@pytest.mark.parametrize("kind", ["P", "PI"])
@pytest.mark.parametrize("effects", [(), ALL], ids=["plain", "all"])
@pytest.mark.parametrize("lag", [None, 0.003])
def test_compiles_without_a_warning_or_a_float(tmp_path, kind, effects, lag):
    drawn = draw(0)
    model = with_effects(drawn, *effects, lag=lag)
    text = to_c(model, design(model, drawn.hardware, kind=kind))
    code = re.sub(r"//.*", "", text)
    assert not re.search(r"\b(float|double|malloc)\b|\d\.\d|[^/]/[^/]", code)
    (tmp_path / "motor.h").write_text(text)
    use = '#include "motor.h"\n#include "motor.h"\nint main(void) { return 0; }\n'
    strict, plus = ["-Wall", "-Wextra", "-Werror", "-O2"], ["-std=c++17", "-Wpedantic"]
    compilers = [
        ("c", ["cc", "-Wconversion", "-Wno-sign-conversion", *FLAGS]),
        ("c", ["avr-gcc", "-mmcu=atmega328p", *FLAGS]),
        ("cpp", ["g++", *plus, *strict]),
        ("cpp", ["avr-g++", "-mmcu=atmega328p", "-std=gnu++11", *strict]),
    ]
    for suffix, compiler in [(s, c) for s, c in compilers if shutil.which(c[0])]:
        (tmp_path / f"use.{suffix}").write_text(use)
        command = [*compiler, "-c", str(tmp_path / f"use.{suffix}"), "-o", str(tmp_path / "use.o")]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


@given(
    st.floats(1e-6, 1e5) | st.floats(-1e5, -1e-6),
    st.integers(1, 2**29),
    st.floats(-1, 1),
)
def test_products_are_right_to_their_rounding(value, largest, share):
    """The C expression in Python's integers: no overflow in between, 3e-5 of the product, and a unit."""
    x = round(share * largest)
    try:
        text = times("x", value, float(largest))
    except OverflowError:
        assert largest * abs(value) >= 2**30
        return

    def times16(x, m):
        assert abs(x) < 2**30 and abs(m) < 2**15
        high, low = (x >> 16) * m, (x & 0xFFFF) * m + 32768
        assert max(abs(high), abs(low), abs(high + (low >> 16))) < 2**31
        return high + (low >> 16)

    found = eval(re.sub(r"(\d)L", r"\1", text), {"motor_times16": times16, "x": x})
    unit = max(1.0, 2 * abs(value)) if "*" in text.split(")")[-1] else 1.0
    assert abs(found - x * value) <= 6.2e-5 * abs(x * value) + 1.01 * unit


@needs_cc
@pytest.mark.parametrize("effects", [(), ALL], ids=["plain", "all"])
def test_feed_forward_is_the_laws(tmp_path, x64, effects):
    drawn = draw(1)
    hardware, model = drawn.hardware, with_effects(drawn, *effects)
    header = Header(to_c(model, design(model, hardware)), tmp_path)
    law, per = feed_forward(model.whole), 256 * hardware.counts_per_tick
    linear = model.motor
    step = float(linear.gain) * -np.expm1(-float(linear.pole) * hardware.period_s)
    rng = np.random.default_rng(0)
    for now, change in zip(rng.uniform(-30, 30, 60), rng.uniform(-2, 2, 60), strict=True):
        now = round(now * per) / per
        following = round((now + change) * per) / per
        linear_volts = now / float(law.gain) + (following - now) / step + float(law.drag(to_jax(now)))
        wanted = float(law.drive(to_jax(linear_volts), to_jax(np.sign(following)))) / hardware.step_V
        found = header.c.ahead(round(now * per), round(following * per))
        assert found == pytest.approx(np.clip(wanted, -250, 250), abs=0.6), (now, change)


@needs_cc
@pytest.mark.parametrize("lag", [None, 0.003])
@pytest.mark.parametrize("effects", [(), ALL], ids=["plain", "all"])
def test_the_estimator_is_pythons(tmp_path, plant_library, effects, lag):
    drawn = draw(2)
    hardware, model = drawn.hardware, with_effects(drawn, *effects, lag=lag)
    made = design(model, hardware)
    header = Header(to_c(model, made), tmp_path)
    duty = np.round(200 * np.sin(np.arange(300) * 0.05) * np.sign(np.sin(np.arange(300) * 0.013 + 1))).astype(int)
    with Plant(drawn.toml) as plant:
        count = plant.sequence(duty, period_s=hardware.period_s).count
    header.c.begin(header.estimate, int(count[0]))
    found = []
    for c, d in zip(count, duty, strict=True):
        found.append(header.c.estimated(header.estimate, int(c)) / 65536 / hardware.counts_per_tick)
        header.c.told(header.estimate, int(d))
    expected = estimate_motion(made.estimator, count, duty * hardware.step_V, hardware).speed
    assert np.abs(expected).max() > 10
    assert np.abs(np.array(found) - expected).max() < 0.02 * float(made.estimator.standard_deviation[0]) + 0.01


@needs_cc
def test_a_speed_is_converted(tmp_path):
    drawn = draw(3)
    header = Header(to_c(drawn.model, design(drawn.model, drawn.hardware)), tmp_path)
    assert header.c.from_mrad_s(12_345) == pytest.approx(12.345 * 256 * drawn.hardware.counts_per_tick, abs=1)


@needs_cc
def test_the_predicted_band_holds_on_the_plant(tmp_path, plant_library):
    """Random motors; `benchmarks/exported_loop.py` has more of them."""
    assert sum(run(seed, tmp_path_of(tmp_path, seed), board=False)[0] for seed in range(6)) >= 5


def test_the_predicted_band_holds_on_the_emulated_board(tmp_path, emulator):
    assert sum(run(seed, tmp_path_of(tmp_path, seed), board=True)[0] for seed in (1, 3, 4, 6)) >= 3


def test_the_boards_duties_are_in_time(tmp_path, emulator):
    """But for the first of an experiment: the plant under the logged duties counts what the board counted."""
    drawn = draw(4)
    header = to_c(drawn.model, design(drawn.model, drawn.hardware))
    count, duty, stats = on_board(header, drawn, 16 * 12, 200, tmp_path)
    with Plant(drawn.toml) as plant:
        again = plant.sequence(duty, period_s=drawn.hardware.period_s, delay_s=40e-6).count
    assert stats["duty_last_cycle"] < 16 * 250
    assert np.abs(np.diff(count[3:]) - np.diff(again[3:])).max() <= 1
    assert abs((count[-1] - count[3]) - (again[-1] - again[3])) <= 2


@needs_cc
@pytest.mark.parametrize("turns", [0.5, -2.0])
def test_the_position_loop_arrives(tmp_path, plant_library, turns):
    drawn = draw(5)
    hardware = drawn.hardware
    made = design(drawn.model, hardware, position_bandwidth_Hz=4.0)
    header = Header(to_c(drawn.model, made), tmp_path)
    target = round(turns * hardware.counts_per_rev)
    with Plant(drawn.toml) as plant:
        count = header.position_loop(plant, target, 300, hardware)
    assert abs(count[-50:] - target).max() <= 2
    assert (count / target).max() < 1.12


@needs_cc
def test_the_loop_runs_on_the_estimated_speed(tmp_path, plant_library):
    """The estimator's speed is smoother, so the duty shakes less."""
    drawn = draw(3)
    hardware = drawn.hardware
    header = Header(to_c(drawn.model, design(drawn.model, hardware, bandwidth_Hz=8.0)), tmp_path)
    reference = round(256 * 30 * hardware.counts_per_tick)
    shakes = []
    for estimated in (False, True):
        with Plant(drawn.toml) as plant:
            _, duty, speed = header.speed_loop(plant, reference, 400, hardware, estimated=estimated)
        assert speed[-100:].mean() == pytest.approx(30, rel=0.01)
        shakes.append(np.std(np.diff(duty[-200:])))
    assert shakes[1] < 0.7 * shakes[0]


def test_a_hostile_name_stays_in_its_comment(tmp_path):
    import dataclasses

    drawn = draw(0)
    model = dataclasses.replace(drawn.model, recording='x\n#error "run"\\\n*/ ??/ <script>é')
    text = to_c(model, design(model, drawn.hardware))
    assert "#error" not in [line.strip()[:6] for line in text.splitlines()]
    assert text.isascii() and not any(line.endswith("\\") for line in text.splitlines())


def test_what_does_not_fit_is_a_sentence():
    drawn = draw(0)
    hardware = Hardware(0.005, 600.0, 7.4, full_scale=5000)
    with pytest.raises(JaxmotorError, match="more than the C header's"):
        to_c(drawn.model, design(drawn.model, hardware))


def tmp_path_of(folder, seed):
    made = folder / str(seed)
    made.mkdir()
    return made
