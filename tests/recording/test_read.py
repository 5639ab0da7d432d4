"""A file is read whole, or refused with one sentence that names the line and the remedy."""

import contextlib
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import FIRST_ROW, TEXT

from jaxmotor.recording import KINDS, Recording, RecordingError, _text, check, read
from jaxmotor.recording._columns import CHOICES
from jaxmotor.recording._header import OWN_KEYS, OWN_SEGMENT_KEYS, TEXTS
from jaxmotor.recording._read import parse


def edited(old: str, new: str) -> str:
    assert old in TEXT
    return TEXT.replace(old, new, 1)


def refusal(text: str | bytes) -> str:
    with pytest.raises(RecordingError) as caught:
        parse(text if isinstance(text, bytes) else text.encode(), "m1.csv")
    sentence = str(caught.value)
    assert sentence.startswith("m1.csv") and "\n" not in sentence and len(sentence) < 400
    return sentence


def test_values_in_si():
    recording = parse(TEXT.encode(), "m1.csv")
    sine, step = recording.segments
    assert recording.measured == "count" and recording.drive == "brake"
    assert recording.header == {"motor": "Pololu 2213, unit 7"}
    assert sine.parameters == {"frequency_Hz": 5.03, "amplitude_V": 5.1}
    assert sine.at_rest and not step.at_rest and step.start_s == 4.0
    np.testing.assert_array_equal(sine.volts, np.array([0, 27, 54]) / 255 * 7.4)
    np.testing.assert_array_equal(step.time_s, np.array([0, 2]) * 0.005)
    np.testing.assert_array_equal(step.count, [9, 30])


def test_all_columns_in_any_order():
    text = """\
# jaxmotor recording 1
# speed_window_s = 0.02
# colour = { of = "shaft", dates = [2024-02-29] }
# [[segment]]
# kind = "other"
speed_rad_s,remark, supply_mV ,volts,current_A,time_s,segment
1.5,warm , 7400,-3,0.25,0,0
-1e-3,,7350.5,3.,-.5,0.0125,0
"""
    recording = parse(text.encode(), "m1.csv")
    segment = recording.segments[0]
    assert recording.period_s is None and recording.measured == "speed" and segment.tick is None
    assert segment.extra["remark"].tolist() == ["warm ", ""]
    assert segment.supply_V is not None and segment.supply_V.tolist() == [7.4, 7.3505]
    assert segment.speed_rad_s is not None and segment.speed_rad_s.tolist() == [1.5, -1e-3]
    assert recording.header["colour"]["of"] == "shaft"


def test_unknown_column_may_be_called_like_a_field():
    text = TEXT.replace("duty,count\n", "duty,count,supply_V\n").replace(",0\n", ",0,x\n", 2)
    text = text.replace(",3\n", ",3,y\n").replace(",9\n", ",9,\n").replace(",30\n", ",30,z\n")
    segment = parse(text.encode(), "m1.csv").segments[0]
    assert segment.supply_V is None and segment.extra["supply_V"].tolist() == ["x", "x", "y"]


def test_counts_are_exact_beyond_floats():
    recording = parse(edited("0,2,54,3\n", f"0,2,54,{2**53 + 1}\n").encode(), "m1.csv")
    assert recording.segments[0].count is not None and recording.segments[0].count[2] == 2**53 + 1


@pytest.mark.parametrize(
    "harmless",
    [
        TEXT.replace("\n", "\r\n"),
        "\ufeff" + TEXT,
        TEXT + "\n\n  \n",
        TEXT.replace("# motor", "#motor"),
        TEXT.replace("# drive", "# # a remark\n#\n# drive"),
        TEXT.replace("0,1,27,0", " 0, 1,\t27 ,+0"),
    ],
)
def test_what_editors_do_is_read(harmless):
    np.testing.assert_array_equal(parse(harmless.encode(), "m1.csv").segments[1].count, [9, 30])


HEADER_DAMAGE = {
    "newer": ("recording 1\n", "recording 4\n", 1, "newer"),
    "no version": ("recording 1\n", "recording one\n", 1, "names no format"),
    "version 0": ("recording 1\n", "recording 0\n", 1, "no format 0"),
    "not TOML": ("drive = ", "drive ", 7, "not TOML"),
    "key twice": ('drive = "brake"', "supply_V = 7", 7, "not TOML"),
    "drive": ("brake", "break", 7, "'break'"),
    "drive type": ('"brake"', "3", 7, "not known"),
    "period text": ("period_s = 0.005", 'period_s = "5 ms"', 3, "not a number"),
    "period true": ("period_s = 0.005", "period_s = true", 3, "not a number"),
    "period negative": ("0.005", "-0.005", 3, "positive"),
    "period zero": ("0.005", "0", 3, "positive"),
    "period NaN": ("0.005", "nan", 3, "positive"),
    "period infinite": ("0.005", "inf", 3, "positive"),
    "counts huge": ("617.4", "1e300", 4, "out of range"),
    "motor": ('"Pololu 2213, unit 7"', "7", 2, "quotes"),
    "count_resets": ('drive = "brake"', 'count_resets = "no"', 7, "true or false"),
    "kind": ('"sine"', '"sin"', 9, "'sin'"),
    "kind type": ('"sine"', "[1]", 9, "one of sine"),
    "no kind": ('kind = "sine"\n', "\n", 8, "no kind"),
    "start": ("start_s = 4.0", "start_s = -4.0", 15, "not negative"),
    "no start": ("# start_s = 4.0\n", "", 13, "no start_s"),
    "at_rest": ("at_rest = false", "at_rest = 0", 16, "true or false"),
    "frequency": ("5.03", "-5.03", 11, "frequency"),
    "frequency NaN": ("5.03", "[1.0, nan]", 11, "frequency"),
    "amplitude": ("5.1", "nan", 12, "finite"),
    "segment table": ("[[segment]]", "[segment]", 13, "not TOML"),
    "late duties": ('drive = "brake"', "duty_delay_s = -1e-6", 7, "not negative"),
    "duties a tick late": ('drive = "brake"', "duty_delay_s = 0.005", 7, "not below the period"),
    "speed window": ('drive = "brake"', "speed_window_s = -1", 7, "not negative"),
    "window rows": ('drive = "brake"', "speed_window_rows = 2.5", 7, "whole number of rows"),
    "window rows alone": ('drive = "brake"', "speed_window_rows = 5", 7, "needs speed_window_s"),
}


@pytest.mark.parametrize("damage", HEADER_DAMAGE.values(), ids=HEADER_DAMAGE)
def test_damaged_header(damage):
    old, new, line, reason = damage
    sentence = refusal(edited(old, new))
    assert f"line {line}:" in sentence and reason in sentence


ROW_DAMAGE = {
    "few fields": ("0,1,27,0", "0,1,27", 2, "3 fields"),
    "many fields": ("0,1,27,0", "0,1,27,0,", 2, "5 fields"),
    "text": ("0,2,54,3", "0,2,54,x", 3, "'x'"),
    "empty": ("0,2,54,3", "0,2,,3", 3, "duty is ''"),
    "NaN": ("0,2,54,3", "0,2,54,nan", 3, "'nan'"),
    "count with a point": ("0,2,54,3", "0,2,54,3.0", 3, "whole number"),
    "tick with a point": ("0,2,54,3", "0,2.5,54,3", 3, "whole number"),
    "duty with an exponent": ("0,2,54,3", "0,2,5e1,3", 3, "whole number"),
    "underscore": ("0,2,54,3", "0,2,5_4,3", 3, "whole number"),
    "tick back": ("0,2,54,3", "0,0,54,3", 3, "runs backwards, from 1 to 0"),
    "tick twice": ("0,2,54,3", "0,1,54,3", 3, "twice"),
    "tick negative": ("0,0,0,0", "0,-1,0,0", 1, "counts up"),
    "tick huge": ("0,2,54,3", "0,20000001,54,3", 3, "beyond"),
    "duty beyond": ("0,2,54,3", "0,2,-256,3", 3, "full scale"),
    "segment unknown": ("1,2,200,30", "2,2,200,30", 5, "no [[segment]]"),
    "segment negative": ("0,0,0,0", "-1,0,0,0", 1, "no [[segment]]"),
    "interleaved": ("0,2,54,3\n1,0,200,9", "1,0,54,3\n0,2,200,9", 4, "together"),
    "comment": ("0,2,54,3", "# 0,2,54,3", 3, "comment"),
    "blank line": ("0,2,54,3", "\n0,2,54,3", 3, "blank"),
    "count overflow": ("0,2,54,3", f"0,2,54,{2**63}", 3, "beyond"),
    "count least": ("0,2,54,3", f"0,2,54,{-(2**63)}", 3, "beyond"),
    "count endless": ("0,2,54,3", "0,2,54," + "9" * 5000, 3, "beyond"),
    "other digits": ("0,2,54,3", "0,2,54,\u0663", 3, "whole number"),
    "carriage return": ("0,2,54,3", "0,2,54,3\r0,3,54,3", 3, "carriage return"),
}


@pytest.mark.parametrize("damage", ROW_DAMAGE.values(), ids=ROW_DAMAGE)
def test_damaged_row(damage):
    old, new, row, reason = damage
    sentence = refusal(edited(old, new))
    assert f"line {FIRST_ROW + row - 1}:" in sentence and reason in sentence


@pytest.mark.parametrize(
    "cell, reason", [("inf", "finite"), ("-nan", "finite"), ("1e400", "finite"), ("1e200", "beyond"), ("0x1", "finite")]
)
def test_damaged_real_number(cell, reason):
    text = TEXT.replace("duty", "volts").replace("0,2,54,3", f"0,2,{cell},3")
    sentence = refusal(text)
    assert f"line {FIRST_ROW + 2}:" in sentence and reason in sentence


@pytest.mark.parametrize(
    "names, reason",
    [
        ("tick,duty,count", "'segment' is missing"),
        ("segment,duty,count", "tick, time_s"),
        ("segment,tick,duty", "count, angle_rad, speed_rad_s"),
        ("segment,tick,count", "duty, volts"),
        ("segment,tick,time_s,duty,count", "exclude"),
        ("segment,tick,duty,volts,count", "exclude"),
        ("segment,tick,duty,count,angle_rad", "exclude"),
        ("segment,tick,duty,count,count", "twice"),
        ("segment,tick,duty,count,", "no name"),
        ("0,0,0,0", "names"),
    ],
)
def test_damaged_column_names(names, reason):
    sentence = refusal(edited("segment,tick,duty,count", names))
    assert f"line {FIRST_ROW - 1}:" in sentence and reason in sentence


@pytest.mark.parametrize("key", ["period_s", "counts_per_rev", "duty_full_scale", "supply_V"])
def test_missing_required_key(key):
    assert f"# {key} = ..." in refusal(edited(f"# {key} =", "# other ="))


def test_period_beside_time_is_a_contradiction():
    assert "period_s" in refusal(TEXT.replace("tick", "time_s"))


def test_time_runs_backwards():
    text = TEXT.replace("tick", "time_s").replace("# period_s = 0.005\n", "").replace("0,2,54,3", "0,0.5,54,3")
    assert f"line {FIRST_ROW + 1}:" in refusal(text)


def test_segment_without_rows():
    assert "line 13:" in refusal(edited("1,0,200,9\n1,2,200,30\n", ""))
    assert "segment 1 has no rows" in refusal(edited("1,0,200,9\n1,2,200,30\n", ""))
    assert "line 8: segment 0 has no rows" in refusal(TEXT[: TEXT.index("0,0,0,0")] + "1,0,0,0\n")


@pytest.mark.parametrize("cut", [1, 2, 5, 12, 40, 90, 200, 330])
def test_truncated(cut):
    cut += TEXT[-cut - 1] == "\n"
    assert refusal(TEXT[:-cut])


def test_truncated_last_line_says_so():
    assert "cut off" in refusal(TEXT[:-1])
    assert f"line {FIRST_ROW + 4}:" in refusal(TEXT[:-1])


def test_no_columns_no_rows():
    assert "no line of column names" in refusal(TEXT[: TEXT.index("segment,tick")])
    assert "no rows" in refusal(TEXT[: TEXT.index("0,0,0,0")])
    assert "no rows" in refusal(TEXT[: TEXT.index("0,0,0,0")] + "\n \n")


@pytest.mark.parametrize(
    "data, reason",
    [
        (b"t,u,y\n0,1,2\n", "jaxmotor import"),
        (b"PK\x03\x04\x14\0\x06\0\x08\0", "save its sheet as CSV"),
        (b"\x89PNG\r\n\x1a\n\0\0\0", "binary"),
        (b"\xff\xfe#\0 \0", "UTF-16"),
        (b"\xe9\xe8 caf\xe9\n", "UTF-8"),
        (TEXT.encode() + b"\0" * 512, "binary"),
        (TEXT.encode().replace(b"unit", b"\xff\xff"), "line 2: not UTF-8"),
        (b"\n", "jaxmotor import"),
    ],
)
def test_other_files(data, reason):
    assert reason in refusal(data)


def test_nesting_is_limited():
    assert "nested" in refusal(edited('drive = "brake"', "deep = " + "[" * 5000 + "]" * 5000))
    assert "nested" in refusal(edited('drive = "brake"', ".".join("a" * 60) + " = 1"))


@pytest.mark.parametrize("number", ["9" * 400, "9" * 5000, "0x" + "f" * 9000, "[1, -18446744073709551616]"])
def test_whole_numbers_beyond_64_bits(number):
    assert "64 bits" in refusal(edited("617.4", number)) or "out of range" in refusal(edited("617.4", number))


def test_too_many_segments():
    more = "# [[segment]]\n# kind = 'rest'\n# start_s = 9.0\n" * 10_001
    assert "10003 segments" in refusal(edited("segment,tick", more + "segment,tick"))


def test_files_that_are_none(tmp_path):
    for path in (tmp_path, tmp_path / "missing.csv", tmp_path / "zero\0.csv"):
        with pytest.raises(RecordingError, match=r"missing|zero|is not a file"):
            read(path)
    empty = tmp_path / "empty.csv"
    empty.write_bytes(b"")
    with pytest.raises(RecordingError, match="empty"):
        read(empty)


@contextlib.contextmanager
def memory():
    """Call what is given for the bytes that were held at once within the block."""
    tracemalloc.start()
    try:
        yield lambda: tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_too_large_is_refused_unread(tmp_path):
    path = tmp_path / "huge.csv"
    with path.open("wb") as file:
        file.truncate(_text.MAX_BYTES + 1)
    with memory() as peak:
        with pytest.raises(RecordingError, match="split it"):
            read(path)
        assert peak() < 1_000_000


def test_ten_million_rows_are_refused_unparsed():
    data = TEXT.encode() + b"1,3,0,0\n" * 10_000_000
    with memory() as peak:
        assert "split it" in refusal(data)
        # Its bytes as text and without a byte order mark; rows that were split would take ten times as much.
        assert peak() < 4 * len(data)


@st.composite
def damaged(draw):
    data = bytearray(TEXT.encode())
    for _ in range(draw(st.integers(1, 3))):
        lines = bytes(data).split(b"\n")
        i, j = draw(st.integers(0, len(lines) - 1)), draw(st.integers(0, len(lines) - 1))
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        match draw(st.sampled_from(["flip", "insert", "delete", "cut", "swap", "double", "drop"])):
            case "flip" if data:
                data[at] ^= 1 << draw(st.integers(0, 7))
            case "insert":
                data[at:at] = draw(
                    st.sampled_from([b",", b"-", b"9", b"e", b".", b"#", b"\n", b'"', b"[", b"\r", b"="])
                )
            case "delete":
                del data[at : at + draw(st.integers(1, 20))]
            case "cut":
                del data[at:]
            case "swap":
                lines[i], lines[j] = lines[j], lines[i]
                data = bytearray(b"\n".join(lines))
            case "double":
                data = bytearray(b"\n".join([*lines[:i], lines[i], *lines[i:]]))
            case "drop":
                data = bytearray(b"\n".join([*lines[:i], *lines[i + 1 :]]))
    return bytes(data)


@settings(max_examples=600)
@given(damaged())
def test_damage_is_a_recording_or_a_sentence(data):
    try:
        recording = parse(data, "m1.csv")
        assert isinstance(recording, Recording)
        check(recording)
    except RecordingError as error:
        assert "m1.csv" in str(error) and "\n" not in str(error) and str(error).isprintable()


@settings(max_examples=200)
@given(st.binary(max_size=200), st.booleans())
def test_rubbish_is_a_sentence(data, with_first_line):
    with pytest.raises(RecordingError) as caught:
        parse(b"# jaxmotor recording 1\n" * with_first_line + data, "m1.csv")
    assert str(caught.value).isprintable()


def test_the_documentation_names_every_key_and_column():
    text = (Path(__file__).parents[2] / "docs" / "recording-format.md").read_text()
    for name in (*KINDS, *OWN_KEYS, *OWN_SEGMENT_KEYS, *TEXTS, *sum(CHOICES, ()), "segment", "supply_mV", "current_A"):
        assert f"`{name}`" in text, name


def test_the_documented_recording_is_read():
    text = (Path(__file__).parents[2] / "docs" / "recording-format.md").read_text()
    assert len(parse(text.split("```")[1].lstrip().encode(), "docs").segments) == 2
