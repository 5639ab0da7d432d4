"""What effects have in common with the linear motor's simulation, and how they stand together."""

import dataclasses
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_cases import PERIOD, STEPS, SUPPLY, fast_turned, linear, motor, number, plan, rows, volts

from jaxmotor.motor import SpeedLaw, simulate, warmth
from jaxmotor.motor._motor import Motor, Rows, SpeedLoop, simulate_motor, steps_for
from jaxmotor.motor.effects import EFFECTS, MeasuredLog, from_free, parameters, to_free, values_at
from jaxmotor.text import capital, named

pytestmark = pytest.mark.usefixtures("x64")
PAGES = Path(__file__).parents[3] / "docs" / "effects"
VOCABULARY = {
    "transport_delay": ("drive", {"delay_s": "s"}),
    "dead_zone": ("drive", {"volts_V": "V"}),
    "input_threshold": ("drive", {"volts_V": "V"}),
    "voltage_offset": ("drive", {"volts_V": "V"}),
    "voltage_saturation": ("drive", {"volts_V": "V"}),
    "direction_asymmetry": ("drive", {"ratio": "1"}),
    "supply_sag": ("drive", {"ratio": "1"}),
    "supply_drift": ("drive", {"rate_per_s": "1/s"}),
    "coast_drive": ("drive", {}),
    "current_limit": ("drive", {"volts_V": "V"}),
    "electrical_pole": ("drive", {"time_constant_s": "s"}),
    "coulomb_friction": ("motion", {"volts_V": "V"}),
    "stiction": ("motion", {"volts_V": "V", "static_volts_V": "V", "stribeck_speed_rad_s": "rad/s", "exponent": "1"}),
    "quadratic_drag": ("motion", {"volts_V_s2_rad2": "V s²/rad²"}),
    "cogging": ("motion", {"volts_V": "V", "cycles_per_rev": "1", "phase_rad": "rad"}),
    "load_torque": ("motion", {"volts_V": "V"}),
    "winding_heating": ("motion", {"rise_ratio": "1", "time_constant_s": "s"}),
    "shaft_compliance": ("motion", {"frequency_Hz": "Hz", "damping_ratio": "1", "inertia_ratio": "1"}),
    "backlash": ("motion", {"gap_rad": "rad", "inertia_ratio": "1"}),
    "encoder_eccentricity": ("sensor", {"amplitude_rad": "rad", "cycles_per_rev": "1", "phase_rad": "rad"}),
    "missed_counts": ("sensor", {"ratio": "1", "speed_rad_s": "rad/s"}),
    "sensor_lag": ("sensor", {"time_constant_s": "s"}),
    "cubic_drive": ("drive", {"cubic_1_V2": "1/V²"}),
    "dead_time": ("drive", {"volts_V": "V"}),
    "cubic_drag": ("motion", {"volts_V": "V"}),
    "sector_friction": ("motion", {"volts_V": "V", "centre_rad": "rad", "width_rad": "rad"}),
    "warming_friction": ("motion", {"volts_V": "V", "rise_ratio": "1", "time_constant_s": "s"}),
    "bristle_friction": ("motion", {"volts_V": "V", "deflection_rad": "rad"}),
}
simulated = eqx.filter_jit(simulate_motor)


def run(motor, rows, duration=PERIOD, steps=STEPS, **options):
    return simulated(motor, rows, number(duration), number(SUPPLY), jnp.asarray(steps), **options)


def test_the_vocabulary_is_complete():
    found = {
        name: (kind.acts_on, {key: about["unit"] for key, about in parameters(kind).items()})
        for name, kind in EFFECTS.items()
    }
    assert found == VOCABULARY
    assert all({field.name for field in dataclasses.fields(kind)} == set(parameters(kind)) for kind in EFFECTS.values())


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effect_has_a_page_that_names_its_parameters(name):
    text = (PAGES / f"{name}.md").read_text()
    assert all(f"`{key}`" in text for key in parameters(EFFECTS[name]))
    assert f"({name}.md)" in (PAGES / "index.md").read_text()
    assert text.startswith(f"# {capital(named(name))} (`{name}`)\n")


def test_pages_are_of_effects():
    assert {path.stem for path in PAGES.glob("*.md")} == {*EFFECTS, "index"}


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_free_parameters_are_the_parameters(name):
    effect = EFFECTS[name].start()
    free = to_free(effect)
    again = from_free(EFFECTS[name].start(), free)
    for key, about in parameters(effect).items():
        assert getattr(again, key) == pytest.approx(float(getattr(effect, key)), rel=1e-12)
        assert about["scale"] > 0
    assert len(free) == sum(about["kind"] != "fixed" for about in parameters(effect).values())
    assert np.isfinite(free).all()


def test_static_friction_is_never_fitted_below_moving_friction():
    effect = EFFECTS["stiction"].of(volts_V=0.3, static_volts_V=0.3, stribeck_speed_rad_s=2.0)
    free = to_free(effect)
    assert free[1] == 0.0 and effect.is_special
    assert effect.told()[0] == EFFECTS["coulomb_friction"].says
    for more in (0.0, 0.1, 2.0):
        other = from_free(effect, free + np.array([0.5, more, 0.0]))
        assert float(other.static_volts_V) / float(other.volts_V) == pytest.approx(np.exp(more))
        assert other.is_special == (more == 0.0)
    assert not any(EFFECTS[name].start().is_special for name in EFFECTS)


def test_no_effect_is_the_linear_motor():
    driven = rows(volts(plan()))
    for first_order in (True, False):
        own = linear(first_order)
        expected = simulate(own, driven.volts, driven.reset, driven.initial_speed, number(PERIOD))
        found = run(Motor(own), driven)
        np.testing.assert_allclose(found.turn, expected.turn, atol=1e-12)
        np.testing.assert_allclose(found.speed, expected.speed, atol=1e-10)
        np.testing.assert_array_equal(found.sensed_turn, found.turn)


def test_all_effects_together_are_neutral_together():
    """All that one motor can have: one load, and a current with lag."""
    effects = tuple(kind.neutral() for name, kind in EFFECTS.items() if name not in ("coast_drive", "backlash"))
    driven = rows(volts(plan()))
    found = fast_turned(Motor(linear(False), effects, number(0.0)), driven)
    expected = simulate(linear(False), driven.volts, driven.reset, driven.initial_speed, number(PERIOD)).turn
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_order_in_which_effects_are_given_does_not_matter():
    names = ["voltage_offset", "dead_zone", "direction_asymmetry", "supply_drift", "voltage_saturation"]
    driven = rows(volts(plan()))
    found = [fast_turned(motor(*order), driven) for order in (names, names[::-1])]
    np.testing.assert_array_equal(*found)


def test_two_loads_are_refused():
    with pytest.raises(ValueError, match="backlash and shaft_compliance"):
        run(motor("backlash", "shaft_compliance"), rows(volts(plan())))


def test_more_steps_change_little_and_need_no_other_program():
    driven = rows(volts(plan()))
    counted = eqx.debug.assert_max_traces(lambda steps: run(motor("stiction"), driven, steps=steps).turn, max_traces=3)
    few, more, many = (np.cumsum(counted(number(steps).astype(jnp.int32))) for steps in (5, 10, 40))
    assert np.abs(few - many).max() < 1e-3 and np.abs(more - many).max() < 1e-3


def test_steps_are_short_beside_a_millisecond_and_the_pole():
    assert [steps_for(*of) for of in ((0.005, 40.0), (0.01, 20.0), (0.005, 300.0), (1e-4, 5.0))] == [5, 10, 15, 1]


@pytest.mark.parametrize("delay", [0.0, 0.0031, 0.005, 0.0124])
def test_delay_is_a_shift_of_finer_ticks(delay):
    """By 0.1 ms ticks, in which the voltage changes where it should."""
    fine = 50
    driven = volts(plan())[:300]
    late = np.concatenate([np.zeros(round(delay / PERIOD * fine)), np.repeat(driven, fine)])[: 300 * fine]
    exact = rows(late)
    expected = simulate(linear(False), exact.volts, exact.reset, exact.initial_speed, number(PERIOD / fine)).turn
    effect = EFFECTS["transport_delay"].of(delay_s=delay)
    found = run(Motor(linear(False), (effect,)), rows(driven)).turn
    np.testing.assert_allclose(found, np.asarray(expected).reshape(300, fine).sum(1), atol=1e-10)


def test_uneven_rows_are_even_rows_left_out_where_the_voltage_is_the_same():
    at = motor("coulomb_friction", "supply_sag")
    driven = np.repeat(volts(plan())[30:110], 3)
    kept = np.union1d(np.arange(0, 240, 3), np.arange(0, 240, 7))
    fine = run(at, rows(driven), steps=7)
    length = np.diff(kept, append=240) * PERIOD
    even = rows(driven)
    coarse = run(at, Rows(*(None if field is None else field[kept] for field in even)), length, steps=21)
    angle = np.concatenate([[0.0], np.cumsum(fine.turn)])
    np.testing.assert_allclose(np.cumsum(coarse.turn), angle[np.append(kept[1:], 240)], atol=2e-4)


def test_experiments_end_to_end_do_not_know_of_each_other():
    at = motor("transport_delay", "sensor_lag", "coulomb_friction", "shaft_compliance")
    parts = [volts(plan())[:300], volts(plan())[300:]]
    starts = [0.0, 9.0]
    alone = []
    for part, start in zip(parts, starts, strict=True):
        driven = rows(part)
        alone.append(run(at, driven._replace(initial_speed=driven.initial_speed.at[0].set(start))))
    driven = rows(np.concatenate(parts))
    reset, speed = driven.reset.at[300].set(True), driven.initial_speed.at[300].set(9.0)
    together = run(at, driven._replace(reset=reset, initial_speed=speed))
    for found, expected in zip(together, zip(*alone, strict=True), strict=True):
        np.testing.assert_allclose(found, np.concatenate(expected), atol=1e-12)


def winding_alone(back):
    """The current of a winding, in volts across the cold one, and its slope over the speed."""
    return lambda volts, speed, time, rise: ((volts - back * speed) / (1 + rise), -back / (1 + rise))


def test_a_winding_stays_warm_between_experiments_and_cools_in_pauses():
    at = motor("winding_heating")
    [heating] = at.effects
    driven = rows(np.full(400, SUPPLY))
    later = jnp.where(jnp.arange(400) < 200, 0.0, 4.0)
    cut = driven._replace(reset=driven.reset.at[200].set(True), time=driven.time + later)
    found = run(at, cut)
    cold = run(at, driven._replace(reset=cut.reset, warmth=jnp.zeros(400)))
    back = (1 - at.viscous_share) / at.linear.gain
    speed = found.turn / PERIOD
    exact = MeasuredLog(cut.volts, speed, cut.time, None, number(PERIOD), number(SUPPLY), number(0.0))
    alone = winding_alone(back)
    warmth = heating.history(exact, back, number(np.inf), alone)  # an infinitely fast motor brakes without heat
    known = run(at, cut._replace(warmth=warmth))
    np.testing.assert_allclose(known.turn, found.turn, atol=2e-5)
    np.testing.assert_array_equal(found.turn[:200], cold.turn[:200])
    assert np.abs(found.turn - cold.turn)[200:].max() > 2e-4
    assert 0 < warmth[200] < warmth[199] * np.exp(-3.9 / 5.0)
    braked = heating.history(exact, back, at.linear.pole, alone)[200] - warmth[200]
    energy = (back * speed[199] / SUPPLY) ** 2 / (2 * at.linear.pole)
    np.testing.assert_allclose(braked, 2.0 / 5.0 * energy * np.exp(-4.0 / 5.0), rtol=0.05)


@pytest.mark.parametrize(
    "others",
    [
        ("supply_sag", "dead_zone"),
        ("current_limit", "supply_drift"),
        ("coast_drive", "coulomb_friction"),
        ("transport_delay",),
        ("sensor_lag", "voltage_offset"),
    ],
    ids="+".join,
)
def test_the_warmth_of_a_recording_knows_the_other_laws_of_the_current(others):
    """What is followed through the log is what the simulation, row by row, keeps in mind."""
    at = motor("winding_heating", *others)
    driven = rows(volts(plan()))
    found = run(at, driven)
    cut = driven._replace(
        reset=driven.reset.at[300].set(True), initial_speed=driven.initial_speed.at[300].set(found.speed[300])
    )
    about = (None, number(PERIOD), number(SUPPLY), number(0.0))
    rise = warmth(at, MeasuredLog(cut.volts, found.sensed_turn / PERIOD, cut.time, *about))
    known = run(at, cut._replace(warmth=rise))
    cold = run(at, cut._replace(warmth=jnp.zeros_like(cut.volts)))
    # What the experiment that is cut here no longer knows of the one before is forgotten by then.
    own = np.abs(found.turn - cold.turn)[380:].max()
    assert np.abs(found.turn - known.turn)[380:].max() < 0.03 * own, own


def test_rounding_does_not_heat_a_winding():
    """The mean square of a rounded speed is larger than that of the speed by what rounding is known to add."""
    [heating] = motor("winding_heating").effects
    size, deviation = 4000, 3.0
    volts, speed, time = np.full(size, 5.0), np.full(size, 20.0), np.arange(size) * PERIOD
    noisy = speed + deviation * (-1.0) ** np.arange(size)
    about, back = (None, number(PERIOD), number(SUPPLY)), number(0.09)

    def end(speed, variance):
        measured_log = MeasuredLog(number(volts), number(speed), number(time), *about, number(variance))
        return float(heating.history(measured_log, back, number(40.0), winding_alone(back))[-1])

    exact = end(speed, 0.0)
    assert abs(end(noisy, deviation**2) / exact - 1) < 0.0015
    assert end(noisy, 0.0) / exact - 1 > 0.0025


def test_friction_holds_up_to_its_size():
    at = motor("coulomb_friction", volts_V=0.4)
    for level, moves in ((0.39, False), (-0.39, False), (0.41, True)):
        turn = run(at, rows(np.full(400, level))).turn
        assert bool(np.abs(turn).max() > 0) == moves


def test_friction_stops_a_motor_that_coasts_and_holds_it():
    at = motor("coulomb_friction", first_order=True, volts_V=0.4)
    driven = rows(np.zeros(400))
    speed = run(at, driven._replace(initial_speed=driven.initial_speed.at[0].set(20.0))).speed
    stop = np.log1p(20.0 / (at.linear.gain * 0.4)) / at.linear.pole / PERIOD
    assert np.flatnonzero(speed == 0)[0] == np.ceil(stop)
    assert not speed[int(stop) + 1 :].any() and (speed[: int(stop)] > 0).all()


def test_coast_drive_gives_no_current_at_duty_zero():
    """What is left is viscous friction, the share β of the pole."""
    at = motor("coast_drive")
    driven = rows(np.zeros(200))
    speed = run(at, driven._replace(initial_speed=driven.initial_speed.at[0].set(20.0))).speed
    decay = at.viscous_share * at.linear.pole * PERIOD
    np.testing.assert_allclose(speed, 20.0 * np.exp(-float(decay) * np.arange(200)), rtol=1e-3)


def test_speed_loop_reaches_its_reference_and_does_not_wind_up():
    loop = SpeedLoop(SpeedLaw.of(0.1, 2.0, SUPPLY))
    driven = rows(np.repeat([200.0, 40.0], 200))
    found = run(motor("coulomb_friction"), driven, controller=loop)
    assert found.volts[150] == SUPPLY
    assert found.speed[-1] == pytest.approx(40.0, rel=1e-3)
    assert found.speed[260] == pytest.approx(40.0, rel=0.1)


def test_closed_loop_is_differentiable():
    driven = rows(np.repeat([0.0, 30.0, -20.0], 60))

    def speed(size):
        effect = EFFECTS["coulomb_friction"](volts_V=size)
        loop = SpeedLoop(SpeedLaw.of(0.1, 2.0, SUPPLY))
        return simulate_motor(Motor(linear(True), (effect,)), driven, number(PERIOD), number(SUPPLY), 5, loop).speed

    fast, size, step = jax.jit(speed), number(0.3), 1e-6
    expected = (fast(size + step) - fast(size - step)) / (2 * step)
    np.testing.assert_allclose(jax.jacfwd(speed)(size), expected, atol=1e-4 * np.abs(expected).max())


def test_a_sensor_of_speed_lags():
    at = motor("sensor_lag", first_order=True)
    driven = rows(np.full(60, 3.0))
    found = run(at, driven)
    time, pole, lag = np.arange(60) * PERIOD, at.linear.pole, 0.006
    final = at.linear.gain * 3.0
    other = 1 / lag
    expected = final * (1 - (other * np.exp(-pole * time) - pole * np.exp(-other * time)) / (other - pole))
    np.testing.assert_allclose(found.sensed_speed, expected, atol=0.01 * float(final))


def test_single_precision_stays_close():
    driven = rows(volts(plan()))
    expected = fast_turned(motor("coulomb_friction"), driven)

    def single(leaf):
        return leaf.astype(jnp.float32) if leaf.dtype == jnp.float64 else leaf

    at, driven = jax.tree.map(single, (motor("coulomb_friction"), driven))
    with jax.enable_x64(False):
        found = simulate_motor(at, driven, jnp.float32(PERIOD), jnp.float32(SUPPLY), 5).turn
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, expected, atol=2e-4)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_values_of_many_are_those_of_each(name):
    """In the order of the tree's leaves, which batches of motors are built from."""
    effect = EFFECTS[name].start()
    rows_ = to_free(effect) + 0.1 * np.arange(3)[:, None] * np.ones(len(to_free(effect)))
    together = values_at(effect, rows_)
    each = [from_free(effect, row) for row in rows_]
    assert list(together) == list(parameters(effect)) and len(together) == len(jax.tree.leaves(effect))
    for column, leaves in zip(together.values(), zip(*map(jax.tree.leaves, each), strict=True), strict=True):
        np.testing.assert_array_equal(column, np.asarray(leaves, column.dtype), strict=False)


MIRRORED = sorted(set(EFFECTS) - {"load_torque", "cogging", "encoder_eccentricity", "sector_friction"})
"""Without those of which a parameter says which way or where they act."""


@pytest.mark.parametrize("name", MIRRORED)
def test_a_motor_that_turns_against_the_voltage_is_its_mirror_image(name):
    ahead = motor(name)
    back = eqx.tree_at(lambda motor: motor.linear.gain, ahead, -ahead.linear.gain)
    driven = rows(volts(plan()))
    one, other = run(ahead, driven), run(back, driven)
    np.testing.assert_allclose(other.sensed_turn, -one.sensed_turn, atol=1e-9 * float(jnp.abs(one.sensed_turn).max()))
