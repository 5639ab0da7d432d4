"""One hostile recording through `jaxmotor report`, and the page that comes of it."""

import csv
import dataclasses
import hashlib
import html
import json
import re

import numpy as np
import pytest
from opened import Watched
from report_pages import HOSTILE, Page, check_closed, check_readable, contrast, hovers
from testing.made import plan, sine
from testing.made import recording as made_recording

from jaxmotor.cli import main
from jaxmotor.diagnosis import ResidualVoltage, to_json
from jaxmotor.estimate import Allowed, OpenHypothesis, fit_percent
from jaxmotor.estimate import to_json as fit_json
from jaxmotor.present import report as reports
from jaxmotor.present.report import report_page
from jaxmotor.present.report._html import Html, element, escaped
from jaxmotor.recording import import_log, read, write
from jaxmotor.validation import Interval
from jaxmotor.validation import to_json as validation_json

MOTORS = ("linear", "extended")
RUNS = [*plan(), *(sine(f, amplitude=2.0) for f in (0.7037, 1.507, 3.011))]
HEADER = {
    "motor": HOSTILE,
    "rig": '"><img src=x onerror=alert(2)>',
    "notes": "</style></title></pre><svg/onload=alert(3)> ]]> <!-- \u202e &amp; 电机",
    "odd <b>key</b>": "'; alert(4); '",
}


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """The story, the recording's path, and the text of the page."""
    folder = tmp_path_factory.mktemp("report")
    recording = dataclasses.replace(made_recording(3, friction=0.2, runs=RUNS), header=HEADER)
    path = folder / "it's <i>.csv"
    write(recording, path)
    stories = []
    plain = reports.story

    def keep(*args, **kwargs):
        stories.append(plain(*args, **kwargs))
        return stories[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JAXMOTOR_CACHE", "")
        patch.setattr(reports, "story", keep)
        assert main(["report", str(path), "-o", str(folder / "out")]) == 0
    return stories[0], path, folder / "out" / "it's <i>.html"


@pytest.fixture(scope="module")
def page(told):
    return Page(told[2].read_text(encoding="utf-8"))


def test_is_one_small_file(told):
    assert [path.name for path in told[2].parent.iterdir()] == [told[2].name]
    assert told[2].stat().st_size < 3_000_000


def test_is_closed_and_readable(page):
    check_closed(page)
    check_readable(page)


def test_names_show_as_text(page):
    words = "".join(page.words)
    assert HOSTILE in page.words
    for text in HEADER.values():
        assert text.replace("\u202e", "\N{REPLACEMENT CHARACTER}") in words
    assert "odd <b>key</b>" in words and "it's <i>.csv" in words
    assert "<script>alert" not in page.text and "onerror=alert(2)>" not in page.text


def test_numbers_are_those_of_the_json(told, page):
    story = told[0]
    known = to_json(story.diagnosis) | {
        "fit": fit_json(story.diagnosis.fit)["model"],
        "validation": validation_json(story.validation),
        "frequency_response": fit_json(story.diagnosis.fit)["frequency_response"],
    }
    known["frequency_response"]["frequency_Hz"].sort()
    linear = story.diagnosis.motor.linear
    known["model"]["electrical_time_constant_s"] = float(getattr(linear, "electrical_time_constant", 0.0))
    known["model"]["viscous_share"] = float(story.diagnosis.motor.viscous_share)
    assert len(page.data) > 40
    for key, found in page.data.items():
        wanted = known
        for step in key.split("."):
            wanted = wanted[int(step)] if isinstance(wanted, list) else wanted[step]
        assert {value for value, _ in found} == {"" if wanted is None else repr(wanted)}, key
    assert json.loads(page.blocks["pre"][-1]) == to_json(story.diagnosis)
    [(value, shown)] = page.data["model.gain_rad_s_V"]
    assert float(shown.split()[0]) == pytest.approx(float(value), rel=1e-4) and shown.endswith(" rad/s/V")


def test_says_what_was_hidden(told, page):
    """0.2 V of friction, which the recording was made with."""
    diagnosis = told[0].diagnosis
    assert diagnosis.verdict != "complete" and diagnosis.effects[0].name == "coulomb_friction"
    [(value, shown)] = page.data["effects.0.parameters.volts_V"]
    assert float(value) == pytest.approx(0.2, abs=0.02) and shown.endswith(" mV")
    assert float(shown.removesuffix(" mV")) == pytest.approx(1e3 * float(value), abs=0.05)
    words = "".join(page.words)
    assert diagnosis.effects[0].effect.advice in words and "Alternatives: chi2 per sample of held-out data" in words
    assert hashlib.sha256(told[1].read_bytes()).hexdigest() in words


def first_screen(page):
    """The words above the contents."""
    head = re.sub(r"<svg.*?</svg>|<script.*?</script>", "", page.text.partition("<nav")[0], flags=re.S)
    return html.unescape(" ".join(re.sub(r"<[^>]*>", " ", head.partition("<body")[2]).split()))


def test_the_first_screen_is_for_who_built_it(told, page):
    diagnosis, words = told[0].diagnosis, first_screen(page)
    linear, [found] = diagnosis.motor.linear, diagnosis.effects
    gain, pole = float(linear.gain), float(linear.pole)
    assert "This is a linear motor with Coulomb friction; that explains all that the recording shows." in words
    number = r"(-?[\d.]+) ± ([\d.]+)"
    rpm, radians, lag, volts = (
        re.search(f"{number} {unit}", words) for unit in ("rpm/V", "rad/s/V", "ms until 63 %", "V below 0.2 V it does")
    )
    for shown, value, error in (
        (rpm, gain * 60 / (2 * np.pi), diagnosis.standard_error["gain_rad_s_V"] * 60 / (2 * np.pi)),
        (radians, gain, diagnosis.standard_error["gain_rad_s_V"]),
        (lag, 1e3 / pole, 1e3 * diagnosis.standard_error["pole_rad_s"] / pole**2),
        (volts, found.parameters["volts_V"], found.standard_error["volts_V"]),
    ):
        assert float(shown[1]) == pytest.approx(value, rel=1e-4)
        assert float(shown[2]) == pytest.approx(1.96 * error, rel=0.06)
    assert f"Coulomb friction {100 * found.probability:.0f} %" in words
    assert "none of these < 1 %" in words and found.effect.advice in words
    for below in ("chi2", "pole", "verdict", "extended:", "volts_V"):
        assert below not in words, below
    assert [one["name"].partition(", fit ")[0] for one in hovers(page)[0]["series"]] == ["measured", *MOTORS]
    assert [one["name"] for one in hovers(page)[1]["series"]] == [*MOTORS]


def test_the_first_screen_says_no_more_than_is_known(told):
    """An effect with a likelier alternative, and one that the input leaves open."""
    diagnosis, [found] = told[0].diagnosis, told[0].diagnosis.effects
    alternatives = tuple(dataclasses.replace(one, inseparable=one.name == "stiction") for one in found.alternatives)
    assert any(one.inseparable for one in alternatives)
    found = dataclasses.replace(found, probability=0.3, family_probability=1.0, alternatives=alternatives)
    unsure = dataclasses.replace(diagnosis, effects=(found,))
    words = first_screen(Page(report_page(dataclasses.replace(told[0], diagnosis=unsure), "0")))
    assert "with Coulomb friction or stiction (indistinguishable in this recording)" in words
    assert "if it is that, below 0.2 V it does not move" in words and "stiction instead 70 %" in words
    assert f"If it is Coulomb friction: {found.effect.advice}" in words
    hidden = OpenHypothesis("friction", 0.31, 12.0, 41.0)
    undecided = dataclasses.replace(
        diagnosis,
        effects=(),
        verdict="unexplained",
        undecided=True,
        open_hypotheses=(hidden,),
        allowed=Allowed((10.0, 12.0), (20.0, 50.0)),
    )
    words = first_screen(Page(report_page(dataclasses.replace(told[0], diagnosis=undecided), "0")))
    assert "but Coulomb friction would not show under this input" in words
    assert "with what the input leaves open, 95.49 to 114.6 rpm/V and 20 to 50 ms." in words
    assert "not known: up to 0.31 V would not show" in words and "add steps of a second height" in words


def test_plots_show_the_data(told, page):
    panels = hovers(page)
    labels = [panel["y"] for panel in panels]
    for label in ("Voltage (V)", "Gain (dB re 1 rad/s/V)", "Phase (degrees)", "Residual voltage (mV)", "Speed (rad/s)"):
        assert label in labels
    response = told[0].diagnosis.fit.frequency_response
    gain = panels[labels.index("Gain (dB re 1 rad/s/V)")]
    measured = {one["name"]: one for one in gain["series"] if one["name"].startswith("measured")}
    assert list(measured) == ["measured at 5.1 V", "measured at 2 V"]
    left, top, width, height = gain["box"]
    order, amplitude = np.argsort(response.frequency_Hz), np.asarray(response.amplitude_V)
    for name, volts in (("measured at 5.1 V", 5.1), ("measured at 2 V", 2.0)):
        rows = [row for row in order if abs(amplitude[row] / volts - 1) < 0.05]
        wanted = 20 * np.log10(np.abs(np.asarray(response.response)[rows]))
        assert np.array(measured[name]["value"], float) == pytest.approx(wanted, rel=1e-3)
        assert all(left <= x <= left + width for x in measured[name]["x"])
        assert all(top <= y <= top + height for y in measured[name]["y"])
        # Higher gains stand higher.
        assert (np.argsort(measured[name]["y"]) == np.argsort(-wanted)).all()


def test_the_extended_motor_answers_sines_as_the_real_one_does(told, page):
    panels = hovers(page)
    left = next(panel for panel in panels if panel["y"] == "Residual (dB)")
    names = [f"{motor} model at {volts} V" for motor in MOTORS for volts in ("5.1", "2")]
    assert [one["name"] for one in left["series"]] == names
    linear, extended = (
        np.concatenate([np.array(one["value"], float) for one in left["series"] if one["name"].startswith(motor)])
        for motor in MOTORS
    )
    assert len(linear) == len(extended) == len(told[0].diagnosis.fit.frequency_response.frequency_Hz)
    assert np.abs(extended).max() < 0.3 * np.abs(linear).max()


def test_same_story_same_page(told):
    assert report_page(told[0], "0") == report_page(told[0], "0")


def test_a_linear_motor_without_sines_or_steps(told):
    story = told[0]
    nothing = np.zeros(0)
    empty = ResidualVoltage(*([nothing] * 6), noise_V=float("nan"))
    fit = dataclasses.replace(story.diagnosis.fit, frequency_response=None, floor_known=False)
    diagnosis = dataclasses.replace(
        story.diagnosis,
        fit=fit,
        effects=(),
        verdict="complete",
        residual_voltage=empty,
        unexplained_voltage=empty,
        dependences=(),
        unexplained_dependences=(),
    )
    page = Page(report_page(dataclasses.replace(story, diagnosis=diagnosis, validation=None, not_validated="no"), "0"))
    check_closed(page)
    check_readable(page)
    words = "".join(page.words)
    assert "Not done: no." in words and "no frequency response" in words and "No effect is needed" in words
    assert "This is a linear motor: its speed follows the voltage in proportion" in words and "none found" in words


def imported(folder, runs=3, rows=60):
    """A log with uneven time stamps, as `jaxmotor import` reads it, and the times from row to row [ms]."""
    rng, lines, steps, begin = np.random.default_rng(0), ["t,u,deg,run"], [], 0.0
    for run in range(runs):
        time = begin + np.cumsum(np.round(rng.uniform(0.004, 0.007, rows), 6))
        steps.append(1e3 * np.diff(time))
        begin = time[-1] + 0.5
        lines += [f"{t:.6f},{3 * np.sin(9 * t):.4f},{40 * np.cos(9 * t):.4f},{run}" for t in time]
    (folder / "log.csv").write_text("\n".join(lines) + "\n")
    columns = {"time": "t", "input": "u:V", "angle": "deg:deg", "segment": "run"}
    return import_log(folder / "log.csv", **columns), np.concatenate(steps)


def test_uneven_time_stamps_are_said(told, tmp_path):
    story = told[0]
    recording, steps = imported(tmp_path)
    assert recording.period_s is None
    empty = ResidualVoltage(*([np.zeros(0)] * 6), noise_V=float("nan"))
    after = dataclasses.replace(story.diagnosis.held_out.after, chi2_per_sample=0.28)
    own = range(len(recording.segments))
    whole = story.diagnosis.whole
    sides = (tuple(one for one in its if one.segment in own) for its in (whole.traces_before, whole.traces_after))
    diagnosis = dataclasses.replace(
        story.diagnosis,
        whole=dataclasses.replace(whole, **dict(zip(("traces_before", "traces_after"), sides, strict=True))),
        fit=dataclasses.replace(story.diagnosis.fit, floor_known=False, frequency_response=None),
        held_out=dataclasses.replace(story.diagnosis.held_out, after=after, traces_before=()),
        residual_voltage=empty,
        unexplained_voltage=empty,
        adds_up=False,
    )
    changes = {"recording": recording, "validation": None, "not_validated": "no"}
    page = Page(report_page(dataclasses.replace(story, diagnosis=diagnosis, **changes), "0"))
    check_closed(page)
    check_readable(page)
    words = " ".join(" ".join(page.words).split())
    apart = f"{steps.min():.3g} to {steps.max():.3g} ms apart, in the median {np.median(steps):.3g} ms"
    assert f"time stamps uneven: rows are {apart}" in words and "ticks lost" not in words
    assert "too short to show the residual voltage" in words
    assert "imported log = log.csv, time = t, input = u:V, angle = deg:deg, segment = run" in words
    # What was not added up is not called a drift.
    assert "drift chi2" not in words and "twenty ticks" not in words
    assert "which was too large: chi2 says which motor is better" in words


def test_unexplained_is_said(told):
    diagnosis = dataclasses.replace(told[0].diagnosis, effects=(), verdict="unexplained")
    page = Page(report_page(dataclasses.replace(told[0], diagnosis=diagnosis), "0"))
    words = "".join(page.words)
    assert "no effect is named: this says what it depends on, not why." in words
    assert "A linear motor explains a part of what this motor does; no known effect explains the residual." in words
    assert "none found" not in first_screen(page) and "friction not known" in first_screen(page)
    assert diagnosis.looks_like is not None and diagnosis.looks_like.text in words


def test_a_pole_that_is_not_determined_is_no_time_constant(told):
    error = dict(told[0].diagnosis.standard_error)
    wide = dataclasses.replace(told[0].diagnosis, standard_error=error | {"pole_rad_s": 10 * error["pole_rad_s"] + 1e3})
    words = first_screen(Page(report_page(dataclasses.replace(told[0], diagnosis=wide), "0")))
    assert "time constant not determined" in words and "speed per volt not determined" not in words


def unlikely(found, of_family=0.13):
    """`found`, and what it may be instead, next to impossible."""
    return dataclasses.replace(
        found, probability=0.0004, family_probability=0.0009, name_probability=0.0009, of_family=of_family
    )


def test_the_first_sentence_names_no_more_than_the_bars_do(told):
    """What is below 50 % in the bars is no part of the sentence; a family above it is."""
    [found] = told[0].diagnosis.effects

    def words(verdict, *effects):
        diagnosis = dataclasses.replace(told[0].diagnosis, effects=effects, verdict=verdict)
        return first_screen(Page(report_page(dataclasses.replace(told[0], diagnosis=diagnosis), "0")))

    unexplained = words("unexplained", unlikely(found))
    assert "A linear motor explains a part of what this motor does; no known effect explains" in unexplained
    assert "friction not known" in unexplained and "no effect is named" in unexplained
    likely = words("unexplained", unlikely(found, 0.75))
    assert "A linear motor with friction or a loss like it (most like Coulomb friction) explains a part" in likely
    extended = words("extended", unlikely(found))
    assert "This is a linear motor with an effect that this recording does not determine; that explains" in extended
    assert all("vocabulary" not in one for one in (unexplained, likely, extended))


def scored(diagnosis, interval, **changes):
    """`diagnosis` with this fit of held-out data."""
    intervals = dataclasses.replace(diagnosis.held_out.after_intervals, fit_percent=Interval(*interval))
    held_out = dataclasses.replace(diagnosis.held_out, after_intervals=intervals)
    return dataclasses.replace(diagnosis, held_out=held_out, **changes)


@pytest.mark.parametrize(
    ("interval", "how"),
    [
        ((0.7, 0.7, 0.7), "hardly better than their mean does (fit 0.7 %, that"),
        ((20.0, -3.0, 41.0), "not surely better than their mean does (fit 20.0 % [-3, 41], that"),
        ((60.0, 51.0, 68.0), None),
    ],
)
def test_a_model_that_predicts_nothing_gives_no_numbers(told, interval, how):
    def words(**changes):
        diagnosis = scored(told[0].diagnosis, interval, **changes)
        return first_screen(Page(report_page(dataclasses.replace(told[0], diagnosis=diagnosis), "0")))

    found = words(verdict="unexplained")
    if how is None:
        assert "do not use" not in found and "not to be used" not in found and "not surely" not in found
    else:
        assert f"The model predicts held-out data {how} of the mean is 0 %): do not use its numbers." in found
        assert re.search(r"speed per volt not known fitted: [\d.]+ ± [\d.]+ rpm/V, not to be used", found)
        assert "time constant not known" in found and "friction not known" in found
    # Where all that is left is noise, a low fit is that of the noise, and the intervals know it.
    assert "do not use" not in words(verdict="extended")


def test_the_picture_shows_what_its_caption_says(told):
    """The segment in which the squared error fell most in proportion, not the one with the largest error."""
    diagnosis = told[0].diagnosis
    scores = diagnosis.held_out
    pairs = list(zip(scores.traces_before, scores.traces_after, strict=True))
    falls = {
        before.segment: 1 - np.sum(after.residual_rad_s**2) / np.sum(before.residual_rad_s**2)
        for before, after in pairs
        if np.isfinite(fit_percent((before,)))
    }
    best = max(falls, key=falls.__getitem__)
    assert len(falls) > 1 and falls[best] > 0
    words = first_screen(Page(told[2].read_text(encoding="utf-8")))
    said = re.search(r"lower the squared error most, by (> )?(\d+) %: .*?\(segment (\d+)\)", words)
    assert int(said[3]) == best and (said[1] or int(said[2]) == round(100 * falls[best]))


def test_the_file_is_named_once(told):
    """Beside a motor's name; where there is none it is the title."""
    name, story = told[0].recording.name, told[0]
    nameless = dataclasses.replace(story, recording=dataclasses.replace(story.recording, header={}))
    for one in (story, nameless):
        assert first_screen(Page(report_page(one, "0"))).count(name) == 1


def test_names_are_those_of_people(told):
    """No name of the JSON or of the file's header stands outside the JSON and the plans."""
    recording = dataclasses.replace(told[0].recording, header={"lost_samples": 3, "gear_play_rad": 0.5})
    found = told[0].diagnosis.effects[0]
    note = "shaft_compliance: this recording does not determine damping_ratio"
    diagnosis = dataclasses.replace(told[0].diagnosis, effects=(found,), notes=(note,))
    text = report_page(dataclasses.replace(told[0], recording=recording, diagnosis=diagnosis), "0")
    shown = re.sub(r"<(script|style|pre|svg)\b.*?</\1>", "", text, flags=re.S)
    words = html.unescape(" ".join(re.sub(r"<[^>]*>", " ", shown).split()))
    assert not re.findall(r"\b[a-z]+_[A-Za-z0-9_]+", words)
    assert words.count("this recording does not determine damping ratio") == 1
    assert "lost samples 3" in words and "gear play (rad) 0.5" in words and "amplitude (V) = " in words
    assert "Parameters of Coulomb friction parameter value 95 % interval voltage " in words


def test_colours_can_be_told_from_the_paper(page):
    [style] = page.blocks["style"]
    schemes = [dict(re.findall(r"--(\w+): (#\w{6})", block)) for block in re.findall(r":root \{(.*?)\}", style, re.S)]
    assert len(schemes) == 3
    for scheme in schemes:
        for paper in ("paper", "card"):
            for ink in ("ink", "quiet", "blue"):
                assert contrast(scheme[ink], scheme[paper]) >= 4.5, (ink, paper)
        for curve in ("red", "green", "purple", "grey"):
            assert contrast(scheme[curve], scheme["paper"]) >= 3, curve


def test_figures_have_no_colour_that_the_page_does_not_turn_dark(page):
    [style] = page.blocks["style"]
    schemes = [set(re.findall(r"--(\w+):", block)) for block in re.findall(r":root \{(.*?)\}", style, re.S)]
    drawn = [attributes for tag, attributes in page.elements if tag in ("path", "text") and "class" not in attributes]
    colours = {attributes[key] for attributes in drawn for key in ("fill", "stroke") if key in attributes}
    used = {re.fullmatch(r"var\(--(\w+),#\w{6}\)", one) for one in colours - {"none"} if not one.startswith("url(#")}
    assert len(drawn) > 500 and None not in used and all("fill" in attributes for attributes in drawn)
    assert all({one[1] for one in used} <= scheme for scheme in schemes) and len(used) >= 6


def test_correlations_are_those_of_the_joint_covariance(told, page):
    joint = told[0].diagnosis.joint
    assert joint.names[:2] == ("gain_rad_s_V", "pole_rad_s")
    error = np.sqrt(np.diag(joint.covariance))
    words = "".join(page.words)
    table = words.partition("Near ±1 the recording")[2]
    friction = joint.names.index("coulomb_friction.volts_V")
    told_ = re.search(r"Coulomb friction, voltage([+-][\d.]{4})([+-][\d.]{4})", table)
    for place, shown in enumerate(told_.groups()):
        wanted = joint.covariance[friction, place] / error[friction] / error[place]
        assert float(shown) == pytest.approx(wanted, abs=0.0051)


def test_the_residual_of_the_true_law_is_the_encoder_s(told, page):
    """Differences of rounded positions: minus a half at lag 1, nothing beyond it; not so the linear motor's."""
    [panel] = [panel for panel in hovers(page) if panel["y"] == "Autocorrelation"]
    linear, extended = (np.array(one["value"], float) for one in panel["series"])
    assert [one["name"] for one in panel["series"]] == [*MOTORS] and panel["x"] == "Lag (rows)"
    assert linear[0] == extended[0] == 1 and len(extended) == 26
    assert extended[1] == pytest.approx(-0.5, abs=0.06) and np.abs(extended[2:]).max() < 0.1 < linear[2]


def test_whatever_is_not_markup_is_text():
    assert element("p", HOSTILE) == "<p>&lt;script&gt;alert(1)&lt;/script&gt;</p>"
    assert element("p", ["a", Html("<b>"), None], title='"><b>') == '<p title="&quot;&gt;&lt;b&gt;">a<b></p>'
    assert escaped("a\x00b\ud800\u202e") == "a�b��"


@pytest.mark.parametrize("text", ["", "no recording at all", "# jaxmotor recording 1\nsegment,tick,volts,count\n0,0"])
def test_bad_input_is_one_sentence_and_no_file(tmp_path, text, capsys):
    (tmp_path / "m.csv").write_text(text)
    assert main(["report", str(tmp_path / "m.csv"), "-o", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert said.startswith("jaxmotor: ") and said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_header_is_read_back(told):
    assert read(told[1]).header["motor"] == HOSTILE


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_opens_in_a_browser_without_a_request(told, browser, scheme):
    opened = Watched(browser, told[2], color_scheme=scheme)
    assert opened.page.get_by_text(HOSTILE, exact=True).count() == 2
    # The first panel of the third plot is the gain; near a measured frequency that is what is shown.
    [gain] = [panel for panel in hovers(Page(told[2].read_text(encoding="utf-8"))) if panel["y"].startswith("Gain")]
    measured = next(one for one in gain["series"] if one["name"] == "measured at 5.1 V")
    shown = opened.point_at(2, (measured["x"][3] + 3) / 680, 0.1)
    assert f"Frequency (Hz): {measured['at'][3]}" in shown and f"measured at 5.1 V {measured['value'][3]}" in shown
    assert "linear " in shown
    for width in (1000, 360):
        opened.page.set_viewport_size({"width": width, "height": 900})
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= width
    assert len(opened.page.pdf()) > 10_000
    with opened.page.expect_download() as saved:
        opened.page.locator("button.csv").nth(2).click()
    series, *rows = csv.reader(saved.value.path().read_text(encoding="utf-8").splitlines())
    assert series == ["series", "x", "value", "y", "value"]
    ours = [row for row in rows if row[0] == "measured at 5.1 V" and row[3] == gain["y"]]
    assert [[row[2], row[4]] for row in ours] == [
        list(pair) for pair in zip(measured["at"], measured["value"], strict=True)
    ]
    # Moved, looked at and printed: still nothing was asked for, and nothing was said.
    assert opened.requests == [told[2].as_uri()] and opened.wrong == []
    opened.context.close()
