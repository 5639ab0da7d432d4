"""What people are told of a diagnosis, and what it leaves in a folder."""

import dataclasses
import functools
import json
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from diagnosed import of

from jaxmotor._sentences import LINE
from jaxmotor.bench import load_plan
from jaxmotor.cli import main
from jaxmotor.cli._story import diagnosis_text
from jaxmotor.diagnosis import Alternative, FoundEffect, extended_model
from jaxmotor.diagnosis._experiment import experiment
from jaxmotor.diagnosis._study import study_of
from jaxmotor.estimate import read_model
from jaxmotor.motor.effects import EFFECTS, parameters
from jaxmotor.present import before_after, diagnosis_figures, residual_voltage, write_diagnosis
from jaxmotor.present._before_after import best_gain
from jaxmotor.recording import NO_SUPPLY, NO_WINDOW, write
from jaxmotor.text import named, odds, percent, sentence

STRANGE = "\x1b[31m$\\alpha$ {volts_V} \ud800 {0}" + 90 * "x" + ".csv"
MOST_LINES = 25


@functools.cache
def proposed():
    """The motor with friction, and the experiment that would tell it from the linear one."""
    made, found = of("friction")
    with jax.enable_x64(True):
        solver = study_of(made, float(found.linear.linear.pole)).solver
        names = ("coulomb_friction", "dead_zone")
        wanted = experiment(solver, names, found.motor, solver.fit(found.linear), made)
    return made, dataclasses.replace(found, experiments=(wanted,))


def found_effect(name, relative=0.01, inseparable=True):
    effect = EFFECTS[name].start()
    error = {key: relative * abs(float(getattr(effect, key))) for key in parameters(effect)}
    alternatives = [
        Alternative(other, 0.1 * k, inseparable and k == 0) for k, other in enumerate(EFFECTS) if other != name
    ]
    return FoundEffect(effect, error, 30.0, tuple(alternatives[:4]), (), 0.8, 0.9, name_probability=0.9)


def with_effects(*names):
    return dataclasses.replace(of("friction")[1], effects=tuple(map(found_effect, names)))


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effect_is_a_sentence_with_its_parameters(name):
    text, about = sentence(found_effect(name)), parameters(EFFECTS[name])
    measured = [key for key, what in about.items() if what["kind"] not in ("fixed", "phase") or what["unit"] == "V"]
    assert text.count("±") == len(measured) and not set(text) & set("{}_")
    sizes = [key for key, what in about.items() if key != "phase_rad" and "choices" not in what]
    assert all("{" + key + "}" in EFFECTS[name].says for key in sizes)
    assert text[0].islower() and text[-1] != "."
    advice = EFFECTS[name].advice
    assert advice[0].isupper() and advice[-1] == "." and advice.count(".") == 1


@pytest.mark.parametrize(
    ("name", "values", "shown"),
    [
        ("coulomb_friction", {"volts_V": 0.2226}, "takes 222.6 ± 4.4 mV whichever"),
        ("voltage_saturation", {"volts_V": 6.5}, "than 6.50 ± 0.13 V"),
        ("transport_delay", {"delay_s": 0.004}, "acts 4.000 ± 0.078 ms later"),
        ("supply_drift", {"rate_per_s": 1e-3}, "falls by 6.00 ± 0.12 % per minute"),
        ("encoder_eccentricity", {"amplitude_rad": 0.03, "cycles_per_rev": 2.0}, "up to 30.00 ± 0.59 mrad, 2 times"),
        ("quadratic_drag", {"volts_V_s2_rad2": 1e-4}, "takes 10.00 ± 0.20 mV at 10 rad/s"),
        ("missed_counts", {"ratio": 0.05, "speed_rad_s": 40.0}, "above 40.00 ± 0.78 rad/s, 5.000 ± 0.098 % of"),
        ("winding_heating", {"time_constant_s": 20.0}, "within 20.00 ± 0.39 s"),
    ],
)
def test_units_are_those_of_people(name, values, shown):
    effect = EFFECTS[name].start(**values)
    error = {key: 0.01 * abs(float(getattr(effect, key))) for key in parameters(effect)}
    assert shown in sentence(FoundEffect(effect, error, 30.0, (), (), 0.8, 0.9))


def test_an_unknown_error_leaves_the_value():
    effect = EFFECTS["coulomb_friction"].start(volts_V=0.3)
    found = FoundEffect(effect, {"volts_V": math.nan}, 30.0, (), ("volts_V",), 0.8, 0.9)
    assert "takes 300 mV whichever" in sentence(found)


@pytest.mark.parametrize("name", ["clean", "friction", "late", "lag"])
def test_the_story_is_short(name, tmp_path):
    made, found = of(name)
    lines = diagnosis_text(found, write_diagnosis(found, made, tmp_path)).splitlines()
    assert max(map(len, lines)) <= LINE == 110 and len(lines) <= MOST_LINES
    assert lines[0] == f"made.csv: {found.verdict}" and not any(line != line.rstrip() for line in lines)


@pytest.mark.parametrize(
    ("segments", "in_part", "said"),
    [
        ((0,), (0,), "a third of segment 0, with the models fitted to the rest"),
        ((2, 5, 6), (5, 6), "all of segment 2 and a third of segments 5-6, with the models fitted to the rest"),
        ((2,), (), "all of segment 2, with the models fitted to the others"),
    ],
)
def test_the_story_says_what_was_held_out(segments, in_part, said):
    _, found = of("friction")
    held_out = dataclasses.replace(found.held_out, segments=segments, in_part=in_part)
    assert said in " ".join(diagnosis_text(dataclasses.replace(found, held_out=held_out)).split())


def test_a_fit_of_speeds_that_do_not_change_is_not_told_as_a_number():
    _, found = of("friction")
    before = dataclasses.replace(found.held_out.before, fit_percent=math.nan)
    still = dataclasses.replace(found, held_out=dataclasses.replace(found.held_out, before=before))
    assert "nan" not in diagnosis_text(still) and "fit not defined" in diagnosis_text(still)
    assert "nan" not in str(still) and "held out: chi2" in str(still)


@pytest.mark.parametrize(
    ("fit_percent", "chi2", "is_told"), [(-0.1, 1.0, True), (25.0, 1.3, True), (60.0, 1.0, False), (-5.0, 9.0, False)]
)
def test_where_the_speed_hardly_changes_a_fit_is_said_to_say_little(fit_percent, chi2, is_told):
    _, found = of("friction")
    before = dataclasses.replace(found.held_out.before, fit_percent=fit_percent, chi2_per_sample=chi2)
    still = dataclasses.replace(found, held_out=dataclasses.replace(found.held_out, before=before))
    assert ("the speed hardly changes there" in " ".join(diagnosis_text(still).split())) == is_told


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_no_line_is_too_long_whatever_is_found(name):
    others = [other for other in ("stiction", "winding_heating", "shaft_compliance") if other != name][:2]
    lines = diagnosis_text(with_effects(name, *others)).splitlines()
    assert max(map(len, lines)) <= LINE


def test_the_story_names_the_cause_and_what_it_is_worth():
    _, found = of("friction")
    text = " ".join(diagnosis_text(found).split())
    held_out = found.held_out
    for part in (
        f"the residual voltage of the linear model is {1e3 * found.residual_voltage.rms_V:.3g} mV rms at the motor",
        "a torque that depends on the speed",
        f"coulomb_friction (probability {percent(found.effects[0].probability)}",
        "): dry friction takes",
        f"fit {held_out.before.fit_percent:.3g} % [",
        f"-> {held_out.after.fit_percent:.3g} % [",
        f"{held_out.before.chi2_per_sample:.3g} [",
        "all of segments 2, 5, 10, 13-14, with the models fitted to the others",
        EFFECTS["coulomb_friction"].advice,
    ):
        assert part in text, (part, text)
    assert "does not explain this recording" not in text


def test_what_cannot_be_told_apart_is_said_plainly():
    text = " ".join(diagnosis_text(with_effects("sensor_lag", "cogging")).split())
    assert "sensor_lag: may as well be transport_delay: indistinguishable in this recording" in text
    assert "alternatives to cogging: " in text
    apart = dataclasses.replace(of("friction")[1], effects=(found_effect("sensor_lag", inseparable=False),))
    assert "may as well" not in diagnosis_text(apart)


def test_what_to_record_next_is_numbered_as_its_file():
    text = " ".join(diagnosis_text(proposed()[1]).split())
    assert f"record next (1): {proposed()[1].experiments[0].text}" in text


def test_a_disturbance_is_no_part_of_the_motor():
    text = " ".join(diagnosis_text(of("late")[1]).split())
    assert "load_step (probability > 99 %): a change at t = 2" in text
    assert "something acted from outside, which is no part of the motor: a change at t = 2" in text
    assert "load_step: Record again without it" in text and "how sure" in text


def test_with_nothing_wrong_nothing_is_made_of_it():
    text = diagnosis_text(of("clean")[1])
    assert "the linear model explains all that this recording shows" in text and "more than a linear one" not in text


def test_a_name_does_not_steer_the_terminal():
    _, found = of("friction")
    strange = dataclasses.replace(found, fit=dataclasses.replace(found.fit, source=f"folder/{STRANGE}"))
    text = diagnosis_text(strange)
    assert "\\x1b[31m" in text and "\\ud800" in text and all(char.isprintable() for char in text.replace("\n", ""))
    assert max(map(len, text.splitlines())) <= LINE


def test_files_are_the_figures_the_model_and_the_plans(tmp_path):
    made, found = proposed()
    names = [path.name for path in write_diagnosis(found, made, tmp_path)]
    figures = ["made-missing.png", "made-probabilities.png", "made-causes.png", "made-before-after.png"]
    assert names == [*figures, "made-extended.json", "made-next-1.toml"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    assert all((tmp_path / name).stat().st_size > 10_000 for name in figures)
    plan = load_plan(tmp_path / "made-next-1.toml")
    assert plan.period_s == made.period_s and 0 < plan.largest_V <= made.supply_V and len(plan.experiments) == 1


def test_the_model_file_is_the_extended_motor(tmp_path):
    made, found = of("friction")
    write_diagnosis(found, made, tmp_path)
    model = read_model(tmp_path / "made-extended.json")
    assert [effect.name for effect in model.effects] == ["coulomb_friction"]
    [effect], [error] = model.effects, model.effect_errors
    assert float(effect.volts_V) == pytest.approx(found.effects[0].parameters["volts_V"], rel=1e-12)
    assert error["volts_V"] == pytest.approx(found.effects[0].standard_error["volts_V"], rel=1e-12)
    assert float(model.motor.gain) == pytest.approx(float(found.motor.linear.gain), rel=1e-12)
    assert np.sqrt(model.covariance[1, 1]) == pytest.approx(found.standard_error["pole_rad_s"], rel=1e-9)
    assert model.fitted == frozenset(found.fit.fingerprints) and len(model.fitted) == len(made.segments)


def test_a_lag_at_its_bound_is_left_out():
    _, found = of("friction")
    with jax.enable_x64(True):
        lagless = dataclasses.replace(found.motor.linear, electrical_time_constant=jnp.zeros(()))
        motor = dataclasses.replace(found.motor, linear=lagless)
    assert len(extended_model(dataclasses.replace(found, motor=motor)).covariance) == 2


def test_figures_are_those_there_are_data_for():
    assert set(of("clean")[1].plot()) == set(diagnosis_figures(of("clean")[1])) == {"missing"}
    assert set(diagnosis_figures(of("friction")[1])) == {"missing", "probabilities", "causes", "before-after"}


def test_missing_volts_are_drawn_before_and_after():
    _, found = of("friction")
    ax = diagnosis_figures(found)["missing"].axes[0]
    before, after = (
        next(line for line in ax.get_lines() if line.get_label() == f"{n} model") for n in ("linear", "extended")
    )
    assert np.abs(before.get_ydata()).max() > 100 > 30 > np.abs(after.get_ydata()).max()
    assert [ax.get_xlabel().split(" (")[0] for ax in diagnosis_figures(found)["missing"].axes] == [
        "Speed", "Applied voltage", "Shaft angle", "Time in the recording",
    ]  # fmt: skip


def test_causes_are_bars_from_the_floor():
    _, found = of("lag")
    ax = diagnosis_figures(found)["causes"].axes[0]
    ends = [patch.get_x() + patch.get_width() for patch in ax.patches]
    scores, [effect] = found.held_out, found.effects
    alternatives = [scores.drift_after + one.chi2_excess for one in effect.alternatives]
    assert ends == pytest.approx([scores.drift_before, scores.drift_after, *alternatives])
    names = [label.get_text() for label in ax.get_yticklabels()]
    nearest = effect.alternatives[0]
    assert names[:3] == [
        "linear model",
        named(effect.name),
        named(nearest.name) + (" *" if nearest.inseparable else ""),
    ]
    assert ax.get_xscale() == "log" and all(patch.get_x() == 1.0 for patch in ax.patches if patch.get_width() > 0)


def test_probabilities_are_bars_that_add_up():
    _, found = of("friction")
    effects = tuple(dataclasses.replace(found_effect("cogging"), probability=p) for p in (0.8, 0.3))
    ax = diagnosis_figures(dataclasses.replace(found, effects=effects))["probabilities"].axes[0]
    own = [(0.8, 0.1, 0.1), (0.3, 0.6, 0.1)]
    assert [patch.get_width() for patch in ax.patches] == pytest.approx([100 * p for three in own for p in three])
    names = [label.get_text() for label in ax.get_yticklabels()]
    assert names[0] == names[3] == "cogging" and names[2] == names[5] == "none of these"
    assert [name for name, _ in odds(effects[0])][1] == "transport delay instead"
    assert [percent(p) for p in (0.0, 0.004, 0.5, 0.994, 0.999, 1.0)] == [
        "< 1 %", "< 1 %", "50 %", "99 %", "> 99 %", "> 99 %",
    ]  # fmt: skip


def test_one_segment_is_drawn_before_and_after():
    _, found = of("clip")
    before, after = best_gain(found)
    assert before.segment == after.segment and before.segment in found.held_out.segments
    speed, left = diagnosis_figures(found)["before-after"].axes
    lines = {line.get_label().partition(",")[0]: line.get_ydata() for line in speed.get_lines()}
    drawn = [line.get_ydata() for line in left.get_lines() if len(line.get_ydata()) > 2]
    for name, error in zip(("linear", "extended"), drawn, strict=True):
        np.testing.assert_allclose(lines["measured"] - lines[name], error, atol=1e-9)
    assert np.abs(drawn[0]).mean() > 1.5 * np.abs(drawn[1]).mean()
    alone = before_after(dataclasses.replace(found, effects=()))
    assert [line.get_label().partition(",")[0] for line in alone.axes[0].get_lines()] == ["measured", "linear"]


def test_a_few_windows_far_out_press_no_others_flat():
    _, found = of("friction")
    far = found.residual_voltage.volts.copy()
    far[:2] = 40.0
    most = 1e3 * np.abs(found.residual_voltage.volts).max()
    odd = dataclasses.replace(found, residual_voltage=dataclasses.replace(found.residual_voltage, volts=far))
    for ax in residual_voltage(odd).axes:
        assert 0.3 * most < ax.get_ylim()[1] < 3 * most


@pytest.fixture
def files(tmp_path):
    write(of("friction")[0], tmp_path / "rough.csv")
    write(of("clean")[0], tmp_path / "clean.csv")
    return tmp_path


def test_the_command_tells_the_story(capsys, files):
    assert main(["diagnose", str(files / "rough.csv"), str(files / "clean.csv"), "-o", str(files / "out")]) == 0
    text = capsys.readouterr().out
    assert text.startswith("rough.csv: extended\n") and "\nclean.csv: complete\n" in text
    assert {"rough-missing.png", "rough-causes.png", "rough-before-after.png", "rough-extended.json"} <= {
        path.name for path in (files / "out").iterdir()
    }
    (files / "bad.csv").write_text("nothing\n")
    assert main(["diagnose", str(files / "bad.csv"), str(files / "clean.csv"), "--json"]) == 1
    lines = capsys.readouterr()
    assert [json.loads(line)["verdict"] for line in lines.out.splitlines()] == ["complete"]
    assert lines.err.count("\n") == 1 and "bad.csv" in lines.err


@pytest.mark.parametrize(
    ("words", "code"), [([], 2), (["--seed", "-1", "x.csv"], 2), (["--no-such", "x.csv"], 2), (["missing.csv"], 1)]
)
def test_wrong_usage(words, code, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", *words]) == code
    assert "Traceback" not in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_two_recordings_of_one_name_are_refused(capsys, files):
    (files / "again").mkdir()
    (files / "again" / "rough.csv").write_bytes((files / "rough.csv").read_bytes())
    words = [str(files / "rough.csv"), str(files / "again" / "rough.csv"), "-o", str(files / "out")]
    assert main(["diagnose", *words]) == 1
    assert "two recordings are called rough" in capsys.readouterr().err and not (files / "out").exists()


def test_a_supply_that_is_not_known_is_told_beside_effects():
    """A coasting bridge was left out, and something else may stand in its place."""
    found = of("friction")[1]
    noted = dataclasses.replace(found, notes=(NO_SUPPLY,), fit=dataclasses.replace(found.fit, notes=(NO_SUPPLY,)))
    for effects, is_told in (((found_effect("cogging"),), True), ((), False)):
        text = " ".join(diagnosis_text(dataclasses.replace(noted, effects=effects)).split())
        assert (NO_SUPPLY[:60] in text) == is_told


def test_a_window_that_is_not_stated_is_told_beside_a_delay():
    """`identify` said it, but it matters for what is named here."""
    found = of("friction")[1]
    noted = dataclasses.replace(found, notes=(NO_WINDOW,), fit=dataclasses.replace(found.fit, notes=(NO_WINDOW,)))
    for name, is_told in (("transport_delay", True), ("cogging", False)):
        text = " ".join(diagnosis_text(dataclasses.replace(noted, effects=(found_effect(name),))).split())
        assert (NO_WINDOW[:60] in text) == is_told
