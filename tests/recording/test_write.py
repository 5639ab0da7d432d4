"""What is written is read again bit for bit, and what could not be read is not written."""

import dataclasses
import datetime
import tomllib

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from recordings import TEXT, same

from jaxmotor._errors import JaxmotorError
from jaxmotor.recording import KINDS, Recording, RecordingError, Segment, read, to_text, write
from jaxmotor.recording._read import parse
from jaxmotor.recording._toml import toml_lines

texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
nasty = st.one_of(
    texts, st.sampled_from(['"', "\\", "\n# x = 1", "\r\n", "\x00\x1f\x7f\x85\u2028\ufeff", '"""', "[[segment]]"])
)
plain = st.one_of(
    nasty,
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.dates(),
    st.times(),
    st.datetimes(),
    st.datetimes(timezones=st.just(datetime.UTC)),
)
values = st.recursive(
    plain, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(nasty, inner, max_size=3), max_leaves=6
)


def unknown(reserved):
    return st.dictionaries(nasty.filter(lambda key: key not in reserved), values, max_size=3)


RESERVED = {
    *("period_s", "counts_per_rev", "duty_full_scale", "supply_V", "drive", "count_resets"),
    *("speed_window_s", "speed_window_rows"),
    *("segment", "motor", "rig", "firmware", "created", "notes"),
    *("kind", "start_s", "at_rest", "frequency_Hz", "amplitude_V"),
}


def reals(size, limit):
    return st.lists(st.floats(-limit, limit), min_size=size, max_size=size).map(np.array)


def integers(size, limit):
    return st.lists(st.integers(-limit, limit), min_size=size, max_size=size).map(lambda x: np.array(x, dtype=np.int64))


# The strategies draw arguments, and the tests build from them: the run-time check of the annotations draws at random
# by itself, which hypothesis forbids within a strategy.
@st.composite
def segments(draw, ticked, dutied, measured, extras, own):
    size = draw(st.integers(1, 5))
    steps = np.array(draw(st.lists(st.integers(1, 1000), min_size=size, max_size=size)))
    tick = np.cumsum(steps) - steps[0]
    duty = draw(integers(size, own["duty_full_scale"])) if dutied else None
    cells = st.text(st.characters(exclude_categories=["Cs"], exclude_characters=",\r\n\0"), max_size=5)
    return {
        "kind": draw(st.sampled_from(KINDS)),
        "start_s": draw(st.floats(0, 1e6)),
        "at_rest": draw(st.booleans()),
        "parameters": draw(unknown(RESERVED)),
        "time_s": tick * own["period_s"] if ticked else tick * draw(st.floats(1e-6, 1.0)),
        "volts": duty / own["duty_full_scale"] * own["supply_V"] if duty is not None else draw(reals(size, 100.0)),
        "tick": tick if ticked else None,
        "duty": duty,
        "count": draw(integers(size, 2**62)) if measured == "count" else None,
        "angle_rad": draw(reals(size, 1e6)) if measured == "angle" else None,
        "speed_rad_s": draw(reals(size, 1e6)) if measured == "speed" else None,
        "supply_V": draw(integers(size, 20_000)) / 1000 if "supply" in extras else None,
        "current_A": draw(reals(size, 100.0)) if "current" in extras else None,
        "extra": {
            name: np.array(draw(st.lists(cells, min_size=size, max_size=size)), dtype=str)
            for name in ("remark", "supply_V")
            if name in extras
        },
    }


@st.composite
def recordings(draw):
    ticked, dutied = draw(st.booleans()), draw(st.booleans())
    measured = draw(st.sampled_from(["count", "angle", "speed"]))
    extras = draw(st.sets(st.sampled_from(["supply", "current", "remark", "supply_V"])))
    own = {
        "period_s": draw(st.floats(1e-6, 10.0)),
        "duty_full_scale": float(draw(st.integers(1, 70_000))),
        "supply_V": draw(st.floats(0.1, 100.0)),
    }
    window = draw(st.none() | st.floats(0, 1.0))
    parts = segments(ticked, dutied, measured, extras, own | {"duty_full_scale": int(own["duty_full_scale"])})
    return {
        "segments": draw(st.lists(parts, min_size=1, max_size=3)),
        "source": "m1.csv",
        "period_s": own["period_s"] if ticked else None,
        "counts_per_rev": draw(st.floats(1.0, 1e5)),
        "duty_full_scale": own["duty_full_scale"] if dutied else None,
        "supply_V": own["supply_V"] if dutied else None,
        "drive": draw(st.sampled_from([None, "brake", "coast"])),
        "speed_window_s": window,
        "speed_window_rows": draw(st.none() | st.integers(1, 1000)) if window else None,
        "count_resets": draw(st.booleans()),
        "header": draw(unknown(RESERVED)) | draw(st.dictionaries(st.sampled_from(["motor", "notes"]), nasty)),
    }


LOWEST = {
    "segments": [
        {"kind": "sine", "start_s": 0.0, "at_rest": False, "parameters": {"lowest": -(2**63), "highest": 2**63 - 1}}
        | {"time_s": np.zeros(1), "volts": np.zeros(1), "tick": np.array([0]), "count": np.array([0])}
    ],
    "source": "m1.csv",
    "period_s": 1.0,
    "counts_per_rev": 1.0,
    "header": {"": -(2**63), "highest": [2**63 - 1]},
}
"""Whole numbers at the ends of what 64 bits hold."""


@settings(max_examples=150)
@given(recordings())
@example(LOWEST)
def test_round_trip(fields):
    parts = tuple(Segment(**part) for part in fields["segments"])
    recording = Recording(**fields | {"segments": parts})
    text = to_text(recording)
    again = parse(text.encode(), "m1.csv")
    assert same(again, recording)
    assert to_text(again) == text


@settings(max_examples=300)
@given(unknown(set()))
def test_header_values_stay_in_their_line(header):
    lines = toml_lines(header)
    assert not any(set(line) & set("\n\r\x0b\x0c\x1c\x85\u2028\u2029") for line in lines)
    assert tomllib.loads("\n".join(lines)) == header


def test_a_text_cannot_break_out():
    recording = parse(TEXT.encode(), "m1.csv")
    evil = dataclasses.replace(recording, header={"notes": '"\n1,3,255,99\n# duty_full_scale = 1\n'})
    assert same(parse(to_text(evil).encode(), "m1.csv"), evil)
    assert to_text(evil).count("\n") == to_text(recording).count("\n")


@given(st.lists(st.integers(0, 60_000_000), min_size=1))
def test_measured_supply_keeps_its_digits(thousandths):
    text = [f"{value / 1000:.3f}" for value in thousandths]
    rows = "".join(f"0,{k},0,0,{mV}\n" for k, mV in enumerate(text))
    first = TEXT[: TEXT.index('# [[segment]]\n# kind = "step"')] + "segment,tick,duty,count,supply_mV\n" + rows
    again = to_text(parse(first.encode(), "m1.csv"))
    column = [line.split(",")[4] for line in again.splitlines() if line.startswith("0,")]
    assert list(map(float, column)) == list(map(float, text))


def test_written_file_equals_what_was_given(tmp_path):
    recording = parse(TEXT.encode(), "m1.csv")
    write(recording, tmp_path / "m1.csv")
    assert same(read(tmp_path / "m1.csv"), recording)
    assert [path.name for path in tmp_path.iterdir()] == ["m1.csv"]


def changed(**fields):
    recording = parse(TEXT.encode(), "m1.csv")
    first = dataclasses.replace(recording.segments[0], **fields)
    return dataclasses.replace(recording, segments=(first, *recording.segments[1:]))


UNWRITABLE = {
    "NaN": lambda: changed(duty=None, volts=np.array([0.0, np.nan, 1.0])),
    "mixed columns": lambda: changed(duty=None),
    "lengths": lambda: changed(count=np.array([1, 2])),
    "float counts": lambda: changed(count=np.array([1.0, 2.0, 3.0])),
    "volts against duty": lambda: changed(volts=np.array([0.0, 1.0, 2.0])),
    "time against ticks": lambda: changed(time_s=np.array([0.0, 1.0, 2.0])),
    "kind": lambda: changed(kind="sin"),
    "own parameter": lambda: changed(parameters={"kind": "step"}),
    "None": lambda: changed(parameters={"reference": None}),
    "object": lambda: changed(parameters={"reference": object()}),
    "surrogate": lambda: changed(parameters={"label": "\ud800"}),
    "own column": lambda: changed(extra={"tick": np.array(["1", "2", "3"])}),
    "own key": lambda: dataclasses.replace(changed(), header={"period_s": 1.0}),
    "segment key": lambda: dataclasses.replace(changed(), header={"segment": []}),
    "no segments": lambda: dataclasses.replace(changed(), segments=()),
    "no period": lambda: dataclasses.replace(changed(), period_s=None),
    "no counts per turn": lambda: dataclasses.replace(changed(), counts_per_rev=None),
}


@pytest.mark.parametrize("make", UNWRITABLE.values(), ids=UNWRITABLE)
def test_what_cannot_be_read_is_not_written(make, tmp_path):
    path = tmp_path / "m1.csv"
    path.write_text("what was here before")
    with pytest.raises(RecordingError):
        write(make(), path)
    assert path.read_text() == "what was here before"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("cell", ["a,b", "a\nb", "a\r", "a\0b"])
def test_cells_that_would_break_the_row(cell):
    recording = parse(TEXT.encode(), "m1.csv")
    parts = tuple(
        dataclasses.replace(part, extra={"remark": np.array([cell] * len(part))}) for part in recording.segments
    )
    with pytest.raises(RecordingError, match="comma"):
        to_text(dataclasses.replace(recording, segments=parts))


def test_missing_folder(tmp_path):
    with pytest.raises(JaxmotorError, match="cannot be written"):
        write(parse(TEXT.encode(), "m1.csv"), tmp_path / "none" / "m1.csv")
