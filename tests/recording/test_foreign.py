"""Logs from elsewhere enter with stated units; what is not stated is asked for."""

import numpy as np
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import measured_data, same
from typer.testing import CliRunner

from jaxmotor._errors import JaxmotorError
from jaxmotor.cli._import import import_command
from jaxmotor.recording import (
    Recording,
    RecordingError,
    check,
    from_arrays,
    import_log,
    log_unit,
    lost_ticks,
    read,
    write,
)
from jaxmotor.recording._timing import timing

LOG = """\
# some rig, some day
t_s,u_V,speed
0.00,0,0
0.02,0,0
0.04,3,0
0.06,3,90
0.08,-3,180
"""


@pytest.fixture
def imported(tmp_path):
    def of(text, **flags):
        path = tmp_path / "log.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return import_log(path, **flags)

    return of


@pytest.fixture
def refused(imported):
    def of(text, **flags):
        with pytest.raises(RecordingError) as caught:
            imported(text, **flags)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return of


@pytest.mark.parametrize(
    ("flags", "times"),
    [
        ({"begin_s": 0.02}, [0.0, 0.02, 0.04]),
        ({"end_s": 0.05}, [0.0, 0.02, 0.04]),
        ({"begin_s": 0.03, "end_s": 0.06}, [0.0, 0.02]),
        ({"begin_s": 3, "end_s": 6, "period_s": 2}, [0.0, 2.0]),
        ({"time": "t_s:ms", "end_s": 5e-5}, [0.0, 2e-5, 4e-5]),
    ],
)
def test_rows_between_two_moments(imported, flags, times):
    recording = imported(LOG.replace("0.0", "7.0"), speed="speed:deg/s", **flags)
    np.testing.assert_allclose(recording.segments[0].time_s, times, atol=1e-12)
    told = recording.header["imported"]
    assert {key: told.get(key) for key in ("begin_s", "end_s")} == {key: flags.get(key) for key in ("begin_s", "end_s")}


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ({"begin_s": 5}, "from 5 s on after the first row there are 0 rows, of a log that lasts 0.08 s"),
        ({"begin_s": 0.04, "end_s": 0.05}, "there are 1 rows"),
        ({"end_s": -1}, "end_s"),
        ({"end_s": 0.04, "segment": "t_s"}, "begin_s and end_s are on one clock, and each segment starts its own"),
    ],
)
def test_what_is_said_of_moments(refused, flags, told):
    assert told in refused(LOG, speed="speed:deg/s", **flags)


def damaged(style: str) -> tuple[list[int], bytes]:
    """The rows of 200 that are whole, and the log, whose other lines are damaged in the five ways that were seen."""
    rows = [[20 * k, 150, 7.25 * k] for k in range(200)]
    lines = [style.format(*row) for row in rows]
    lines[20] = lines[20][: len(lines[20]) // 2]
    lines[50] = lines[50] + lines[50][4:]
    lines[90] = "boot \x00\udcff\rok"
    lines[120] = style.format(20 * 120, 150, "8x.0")
    lines[150] = style.format(40, 150, 1.0)
    lines[199] = style.format(20 * 199, 150, 1e9).replace("1000000000.0", "")
    kept = [k for k in range(200) if k not in (20, 50, 90, 120, 150, 199)]
    return kept, "\n".join(lines).encode(errors="surrogateescape")


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("0.04,3x,20", "u is '3x', not a finite number; correct or delete the row; or leave it out with drop_damaged"),
        ("nan,3,20", "t is 'nan', not a finite number; correct or delete the row; or leave it out with drop_damaged"),
        ("0.04,3", "2 fields where the columns are 3; correct or delete it; or leave it out with drop_damaged"),
        (
            "\0\0",
            "binary data; give a text file, this one is damaged or another kind; or leave it out with drop_damaged",
        ),
        ("0.04,,20", None),
    ],
)
def test_one_damaged_line_is_told_with_the_option_that_leaves_it_out(tmp_path, line, told):
    path, flags = tmp_path / "log.csv", {"time": "t", "input": "u:V", "speed": "w:rad/s"}
    path.write_text("\n".join(["t,u,w", "0.00,3,0", "0.02,3,10", line, *(f"0.{k:02},3,25" for k in range(6, 20, 2))]))
    if told is None:
        assert len(import_log(path, **flags).segments[0]) == 9
        return
    with pytest.raises(RecordingError) as caught:
        import_log(path, **flags)
    assert told in str(caught.value)
    assert len(import_log(path, **flags, drop_damaged=True).segments[0]) == 9
    if not line.startswith("nan"):
        with pytest.raises(RecordingError) as caught:
            import_log(path, **flags | {"time": None, "period_s": 0.02})
        assert "drop_damaged" not in str(caught.value)


@pytest.mark.parametrize("style", ["{},{},{}", "{} {} {}", "{};{};{};"])
def test_damaged_lines_are_left_out_where_that_is_stated(imported, style):
    kept, log = damaged(style)
    flags = {"columns": "t,u,w", "time": "t:ms", "input": "u:duty:255", "supply_V": 12, "speed": "w:rad/s"}
    with pytest.raises(RecordingError):
        imported(log, **flags)
    recording = imported(log, **flags, drop_damaged=True)
    [segment] = recording.segments
    np.testing.assert_array_equal(segment.tick, kept)
    np.testing.assert_allclose(segment.speed_rad_s, [7.25 * k for k in kept])
    told = recording.header["imported"]
    assert told["damaged_lines"] + told.get("cut_lines", 0) + told.get("missing_rows", 0) == 6


def test_a_torn_log_of_names_and_numbers(imported):
    lines = [f"t:{20 * k} u:3 w:{k}" for k in range(30)]
    lines[7], lines[9] = "t:140 u:3", "t:180 u:3 t:18"
    log = "\n".join(lines)
    recording = imported(log, time="t:ms", input="u:V", speed="w:rad/s", drop_damaged=True)
    assert recording.segments[0].tick.tolist() == [k for k in range(30) if k not in (7, 9)]


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ({}, "2 fields where the columns are 3; correct or delete it; or leave the 3 damaged lines out with drop_dam"),
        ({"drop_damaged": True, "time": None, "period_s": 0.02}, "how many rows a damaged line was is known where"),
        ({"drop_damaged": True, "speed": "note:rad/s"}, "lines are damaged, more than a serial line does; check"),
        ({"drop_damaged": True, "time": "note"}, "lines are damaged, more than a serial line does; check"),
    ],
)
def test_what_is_said_of_damaged_lines(refused, flags, told):
    lines = ["t,note,u", *(f"{k},n{k},{k}" for k in range(40))]
    lines[10], lines[20], lines[30] = "10,3", "20", "30,3,4,5"
    assert told in refused("\n".join(lines), **{"time": "t", "input": "u:V", "speed": "t:rad/s"} | flags)


BY_TURNS = """\
t_s,motor,u_V,speed
0.00,M1,0,0
0.00,M2,0,0
0.02,M1,3,10
0.02,M2,6,40
0.04,M1,3,20
0.04,M2,6,80
"""


@pytest.mark.parametrize(
    ("only", "speeds"), [("motor=M1", [0, 10, 20]), ("motor=M2", [0, 40, 80]), ("u_V=3.0", [10, 20])]
)
def test_one_of_several_motors_by_turns(imported, only, speeds):
    recording = imported(BY_TURNS, speed="speed:rad/s", only=only)
    [segment] = recording.segments
    assert (segment.speed_rad_s.tolist(), recording.period_s) == (speeds, 0.02)
    assert recording.header["imported"]["only"] == only


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ({"only": "motor=M3"}, "column 'motor' is never 'M3'; it is 'M1', 'M2'"),
        ({"only": "wheel=M1"}, "names no column and a value of it, COL=VALUE; the columns are 't_s', 'motor'"),
        ({"only": "motor"}, "names no column and a value of it"),
        ({"segment": "motor"}, "where motors take turns in it, read one of them at a time: only 'motor=M1'"),
        ({"segment": "speed"}, "'speed' changes with every row, and a row alone is no segment; name another column"),
        ({}, "the time stands still at t_s = 0.00"),
        ({}, "where motors take turns, read one of them (only COL=VALUE)"),
    ],
)
def test_motors_by_turns_that_are_not_told_apart(refused, flags, told):
    log = BY_TURNS.replace("6,80", "6,90").replace("M2,0,0", "M2,0,5")
    assert told in refused(log, **{"speed": "speed:rad/s"} | flags)


@pytest.mark.parametrize(
    ("flags", "volts"),
    [
        ({"input_limit": 2}, [0, 0, 2, 2, -2]),
        ({"input_limit": 5}, [0, 0, 3, 3, -3]),
        ({"input": "u_V:duty:2", "input_limit": 2, "supply_V": 6}, [0, 0, 6, 6, -6]),
        ({"input": "u_V:duty:2@1", "input_limit": 1, "supply_V": 6}, [-6, -6, 6, 6, -6]),
    ],
)
def test_inputs_that_were_cut_off_after_they_were_logged(imported, flags, volts):
    recording = imported(LOG, speed="speed:deg/s", **flags)
    np.testing.assert_array_equal(recording.segments[0].volts, volts)
    assert recording.header["imported"]["input_limit"] == flags["input_limit"]


def test_plain_log(imported):
    recording = imported(LOG, speed="speed:deg/s", speed_window_s=0.02)
    segment = recording.segments[0]
    assert recording.period_s == 0.02 and recording.speed_window_s == 0.02 and recording.drive is None
    assert segment.kind == "other" and segment.at_rest and segment.parameters == {}
    np.testing.assert_array_equal(segment.tick, range(5))
    np.testing.assert_array_equal(segment.volts, [0, 0, 3, 3, -3])
    np.testing.assert_allclose(segment.speed_rad_s, [0, 0, 0, np.pi / 2, np.pi], rtol=1e-15)
    assert recording.header["imported"]["speed"] == "speed:deg/s"


@pytest.mark.parametrize(
    "unit, factor",
    [
        ("rad/s", 1),
        ("deg/s", np.pi / 180),
        ("rev/s", 2 * np.pi),
        ("rpm", 2 * np.pi / 60),
        ("rev/min", 2 * np.pi / 60),
        ("counts/s", 2 * np.pi / 500),
        ("m/s", 1 / 0.05),
        ("cm/s", 0.01 / 0.05),
        ("mm/s", 0.001 / 0.05),
        ("in/s", 0.0254 / 0.05),
        ("ft/s", 0.3048 / 0.05),
    ],
)
def test_speed_units(imported, unit, factor):
    recording = imported(LOG, speed=f"speed:{unit}", counts_per_rev=500, wheel_radius_m=0.05)
    np.testing.assert_allclose(recording.segments[0].speed_rad_s, np.array([0, 0, 0, 90, 180]) * factor, rtol=1e-14)
    if "/" in unit:
        angle = imported(LOG, angle=f"speed:{unit.split('/')[0]}", counts_per_rev=500, wheel_radius_m=0.05)
        rate = 60 if unit.endswith("min") else 1
        np.testing.assert_allclose(angle.segments[0].angle_rad[-1], 180 * factor * rate, rtol=1e-14)


@pytest.mark.parametrize(
    "unit, factor", [("3.92rad/s", 3.92), ("-1e3rpm", -1e3 * np.pi / 30), (".5deg/s", np.pi / 360)]
)
def test_a_number_before_a_unit_is_what_one_of_the_column_is(imported, unit, factor):
    recording = imported(LOG, speed=f"speed:{unit}", input="u_V:2.4V")
    np.testing.assert_allclose(recording.segments[0].speed_rad_s, np.array([0, 0, 0, 90, 180]) * factor, rtol=1e-14)
    np.testing.assert_allclose(recording.segments[0].volts, np.array([0, 0, 3, 3, -3]) * 2.4, rtol=1e-15)
    assert log_unit(recording).name == unit.lstrip("-+.0123456789e")


def test_a_supply_of_a_divider_has_a_number_before_its_unit(imported):
    recording = imported("t_s,u_V,speed,adc\n0,0,0,3\n0.1,1,2,3\n0.2,1,3,2.9\n", speed="speed:rpm", supply="adc:2.5V")
    np.testing.assert_allclose(recording.segments[0].supply_V, [7.5, 7.5, 7.25])


@pytest.mark.parametrize("unit, factor", [("V", 1), ("mV", 1e-3), ("percent", 0.12), ("duty:4", 3.0)])
def test_input_units(imported, unit, factor):
    recording = imported(LOG, input=f"u_V:{unit}", supply_V=12, count="speed", counts_per_rev=500)
    np.testing.assert_allclose(recording.segments[0].volts, np.array([0, 0, 3, 3, -3]) * factor, rtol=1e-14)
    assert (recording.duty_full_scale == 4) == (unit == "duty:4")
    assert (recording.segments[0].duty is None) == (unit in ("V", "mV"))


@pytest.mark.parametrize(
    "unit, zero, full, whole",
    [
        ("duty:2000@1500", 1500, 500, True),
        ("duty:127@64", 64, 63, True),
        ("duty:-1@1", 1, -2, True),
        ("duty:255@127.5", 127.5, 127.5, False),
    ],
)
def test_no_voltage_may_have_a_number(imported, unit, zero, full, whole):
    share = np.array([0, 0, 0.6, 0.6, -0.6])
    written = np.rint(zero + share * full) if whole else zero + share * full
    rows = [f"{0.02 * row},{one:g},{row}" for row, one in enumerate(written)]
    recording = imported("\n".join(["t_s,us,speed", *rows]), input=f"us:{unit}", supply_V=12.0, speed="speed:rpm")
    [segment] = recording.segments
    np.testing.assert_allclose(segment.volts, (written - zero) / full * 12, rtol=1e-14)
    assert (segment.duty is not None) == whole == (recording.duty_full_scale == abs(full))
    if whole:
        np.testing.assert_array_equal(segment.duty, np.sign(full) * (written - zero))


def test_fractional_duty_becomes_volts(imported):
    recording = imported(LOG.replace("3,", "0.3,"), input="u_V:duty:1", supply_V=10, speed="speed:rpm")
    assert recording.segments[0].duty is None and recording.duty_full_scale is None
    np.testing.assert_allclose(recording.segments[0].volts[2], 3.0)


@pytest.mark.parametrize("unit, seconds", [("", 1.0), (":s", 1.0), (":ms", 1e-3), (":us", 1e-6)])
def test_time_units(imported, unit, seconds):
    recording = imported(LOG, time=f"t_s{unit}", speed="speed:rpm")
    np.testing.assert_allclose(recording.period_s, 0.02 * seconds, rtol=1e-12)


def test_names_may_hold_colons_and_spaces(imported):
    text = LOG.replace("t_s,u_V,speed", "t: s, bus: u [V],a:b:c")
    recording = imported(text, time="t: s", input="bus: u [V]:V", speed="a:b:c:rpm")
    assert recording.segments[0].speed_rad_s[-1] == pytest.approx(180 * 2 * np.pi / 60)


DIALECTS = {
    "semicolons": LOG.replace(",", ";"),
    "tabs": LOG.replace(",", "\t"),
    "byte order mark": "\ufeff" + LOG,
    "CRLF": LOG.replace("\n", "\r\n"),
    "no last newline": LOG.rstrip(),
    "blank lines": "#\n\n" + LOG + "\n\n",
    "quotes": LOG.replace("u_V", '"u_V"').replace("\n0.04,3", '\n0.04,"3"'),
}


@pytest.mark.parametrize("text", DIALECTS.values(), ids=DIALECTS)
def test_dialects(imported, text):
    assert imported(text, speed="speed:rpm").segments[0].volts.tolist() == [0, 0, 3, 3, -3]


def test_name_with_another_delimiter(imported):
    text = LOG.replace(",", ";").replace("u_V", "u, mean")
    assert imported(text, input="u, mean:V", speed="speed:rpm").segments[0].volts.tolist() == [0, 0, 3, 3, -3]


BAD_LOGS = {
    "decimal commas": (LOG.replace(",", ";").replace(".", ","), "line 3:", "decimal comma"),
    "decimal commas between commas": (LOG.replace(".", ","), "line 3:", "decimal"),
    "no delimiter": ("t_s|u_V|speed\n0|0|0\n1|1|1\n", "line 1:", "comma or semicolon or tab or blanks"),
    "two delimiters": ("t_s,u_V;speed\n0,0;0\n", "line 1:", "not clear"),
    "no names": ("0,0,0\n1,1,1\n", "line 1:", "names"),
    "names only": ("# x\nt_s,u_V,speed\n", "", "rows are needed"),
    "comments only": ("# x\n", "", "rows are needed"),
    "name twice": (LOG.replace("u_V", "speed"), "line 2:", "twice"),
    "comment between": (LOG.replace("0.04", "# pause\n0.04"), "line 5:", "comment"),
    "few fields": (LOG.replace("0.04,3,0", "0.04,3"), "line 5:", "2 fields"),
    "no time": (LOG.replace("0.04,3,0", ",3,0"), "line 5:", "empty"),
    "infinite": (LOG.replace("0.04,3,0", "0.04,inf,0"), "line 5:", "'inf'"),
    "text": (LOG.replace("0.04,3,0", "0.04,off,0"), "line 5:", "'off'"),
    "underscore": (LOG.replace("0.04,3,0", "0.04,1_0,0"), "line 5:", "'1_0'"),
    "huge": (LOG.replace("0.04,3,0", "0.04,1e300,0"), "line 5:", "more than"),
    "time back": (LOG.replace("0.04", "0.01"), "line 5:", "runs backwards"),
    "time twice": (LOG.replace("0.04", "0.02"), "line 5:", "stands still"),
    "first row twice": (
        LOG.replace("0.02", "0"),
        "line 4:",
        "stale first row out (drop_first 1)",
    ),
    "quotes": (LOG.replace("0.04", '"0.04'), "line 5:", "quotes"),
    "binary": (LOG.encode() + b"\0\1", "line 8:", "binary"),
    "empty": ("", "", "empty"),
    "static": ("u,y\n1,2\n2,3\n", "", "no column 't_s'; the columns are 'u', 'y'; a recording needs the time"),
}


@pytest.mark.parametrize("log", BAD_LOGS.values(), ids=BAD_LOGS)
def test_bad_logs(refused, log):
    text, line, reason = log
    sentence = refused(text, speed="speed:rpm")
    assert line in sentence and reason in sentence and "log.csv" in sentence


@pytest.mark.parametrize(
    "flags, reason",
    [
        ({}, "exactly one of"),
        ({"speed": "speed:rpm", "count": "speed"}, "exactly one of"),
        ({"speed": "speed"}, "no unit"),
        ({"speed": "speed:rad"}, "'rad' is not known"),
        ({"speed": "speed:rad/h"}, "not known"),
        ({"angle": "speed:rpm"}, "not known"),
        ({"speed": "speed:V"}, "3.92rad/s of a tachogenerator's volt"),
        ({"speed": "speed:0rpm"}, "'0rpm' begins with 0"),
        ({"speed": "speed:1e400rpm"}, "begins with 1e400"),
        ({"speed": "speed:2krpm"}, "'krpm' is not known"),
        ({"speed": "nothing:rpm"}, "'t_s', 'u_V', 'speed'"),
        ({"speed": "speed:m/s"}, "wheel_radius_m"),
        ({"speed": "speed:counts/s"}, "counts_per_rev"),
        ({"count": "speed"}, "counts_per_rev"),
        ({"count": "t_s", "counts_per_rev": 5}, "not whole"),
        ({"count": "counts", "counts_per_rev": 5}, "no column 'counts'"),
        ({"speed": "speed:rpm", "input": "u_V"}, "no unit"),
        ({"speed": "speed:rpm", "input": "u_V:A"}, "'A' is not known"),
        ({"speed": "speed:rpm", "input": "u_V:duty:4"}, "supply_V"),
        ({"speed": "speed:rpm", "input": "u_V:percent"}, "supply_V"),
        ({"speed": "speed:rpm", "input": "u_V:duty:x", "supply_V": 1}, "no positive number"),
        ({"speed": "speed:rpm", "input": "u_V:duty:-5", "supply_V": 1}, "no positive number"),
        ({"speed": "speed:rpm", "input": "u_V:duty:5@5", "supply_V": 1}, "no positive number"),
        ({"speed": "speed:rpm", "input": "u_V:duty:5@", "supply_V": 1}, "COLUMN:duty:FULL@ZERO where"),
        ({"speed": "speed:rpm", "input": "u_V:duty:2", "supply_V": 1}, "line 5: u_V is 3, beyond"),
        ({"speed": "speed:rpm", "input": "u_V:duty:4@2", "supply_V": 1}, "-3, beyond the full scale of 2 around 2"),
        ({"speed": "speed:rpm", "input": "u_V:duty:4@2", "supply_V": 1}, "what was applied at most (input_limit)"),
        ({"speed": "speed:rpm", "input_limit": 0}, "input_limit is 0"),
        ({"speed": "speed:rpm", "time": "t_s:h"}, "'h' is not known"),
        ({"speed": "speed:rpm", "time": "t"}, "no column 't'"),
        ({"speed": "speed:rpm", "segment": "trial"}, "no column 'trial'"),
        ({"speed": "speed:rpm", "supply_V": -1}, "supply_V"),
        ({"speed": "speed:rpm", "speed_window_s": -1}, "speed_window_s"),
        ({"speed": "speed:rpm", "wheel_radius_m": float("nan")}, "wheel_radius_m"),
    ],
)
def test_what_is_not_stated_is_asked_for(refused, flags, reason):
    assert reason in refused(LOG, **flags)


@pytest.mark.parametrize("below", ["# done\n", "\n\n# 2023-12-13\n# 300 Hz\n\n", "% end"])
def test_comments_below_the_rows_are_left_out(imported, below):
    plain, noted = (imported(text, speed="speed:rpm") for text in (LOG, LOG + below))
    np.testing.assert_array_equal(noted.segments[0].shaft, plain.segments[0].shaft)
    assert "cut_lines" not in noted.header["imported"]


@pytest.mark.parametrize("unit, is_told", [("percent", True), ("duty:255", True), ("duty:1", False), ("V", False)])
def test_a_share_that_is_stated_as_percent_is_told(imported, unit, is_told):
    """The column holds 0.3 for three tenths of the supply."""
    log = imported(LOG.replace("3,", "0.3,"), input=f"u_V:{unit}", speed="speed:deg/s", supply_V=12.0)
    assert any("import it with the unit duty:1" in note for note in check(log)) == is_told


def test_segments(imported):
    text = "t_s,u_V,n,trial\n0,0,5,a\n1,0,5,a\n2,1,6,b\n3,1,7,b\n4,0,9,a\n6,0,9,a\n"
    recording = imported(text, count="n", counts_per_rev=10, segment="trial")
    assert [part.parameters["label"] for part in recording.segments] == ["a", "b", "a"]
    assert [part.start_s for part in recording.segments] == [0, 2, 4]
    assert [part.at_rest for part in recording.segments] == [True, False, True]
    assert [part.tick.tolist() for part in recording.segments] == [[0, 1], [0, 1], [0, 2]]
    assert [lost_ticks(part) for part in recording.segments] == [0, 0, 1]


def test_a_stale_first_row_may_be_left_out(imported, refused):
    log = LOG.replace("0.00,0,0", "1.074,0,0")
    assert "drop_first 1" in refused(log, speed="speed:rpm")
    assert len(imported(log, speed="speed:rpm", drop_first=1).segments[0]) == 4
    assert "drop_first" not in refused(LOG.replace("0.04", "0.02"), speed="speed:rpm")


GAPPED = "t_s,u_V,speed\n" + "".join(
    f"{0.01 * row + 2.0 * (row > 59) + 0.0007 * (row % 3)},{3 * (row % 7 > 3)},{row}\n" for row in range(120)
)


def test_after_a_gap_a_segment_may_begin(imported, refused):
    whole, cut = (imported(GAPPED, speed="speed:rpm", speed_window_s=0.01, gap_s=gap) for gap in (None, 1.0))
    assert [len(segment) for segment in whole.segments] == [120]
    assert [len(segment) for segment in cut.segments] == [60, 60]
    assert cut.segments[1].start_s == pytest.approx(2.6) and cut.header["imported"]["gap_s"] == 1.0
    assert cut.segments[1].time_s[0] == 0.0
    [note] = [note for note in check(whole) if "gap of 2.01 s" in note]
    assert "--gap 1)" in note
    assert not any("gap" in note for note in check(cut))
    assert "name their column" in refused(GAPPED, time=None, period_s=0.01, speed="speed:rpm", gap_s=1.0)
    assert "gap_s is -1" in refused(GAPPED, speed="speed:rpm", gap_s=-1.0)


def test_time_may_restart_with_a_segment(imported, refused):
    text = "t_s,u_V,n,trial\n0,0,5,1\n1,0,5,1\n0,1,6,2\n1,1,7,2\n"
    recording = imported(text, count="n", counts_per_rev=10, segment="trial")
    assert [part.start_s for part in recording.segments] == [0, 2]
    assert "segment" in refused(text, count="n", counts_per_rev=10)


def test_where_time_runs_back_a_segment_may_begin(imported, refused):
    text = "t_s,u_V,n\n0,0,5\n1,0,5\n-0.1,1,6\n1,1,7\n0.5,2,8\n1.5,2,9\n"
    recording = imported(text, count="n", counts_per_rev=10, segment="t_s")
    assert [part.parameters["label"] for part in recording.segments] == ["0", "1", "2"]
    assert [part.volts.tolist() for part in recording.segments] == [[0, 0], [1, 1], [2, 2]]
    assert "segment; 't_s' if each starts its own clock)" in refused(text, count="n", counts_per_rev=10)


@pytest.mark.parametrize(
    "u, n, at_rest", [((0, 0, 1), (5, 5, 6), True), ((0, 0, 1), (5, 6, 6), False), ((0, 1, 1), (5, 5, 6), False)]
)
def test_rest_must_be_seen(imported, u, n, at_rest):
    rows = "".join(f"{k},{u[k]},{n[k]}\n" for k in range(3))
    assert imported("t_s,u_V,n\n" + rows, count="n", counts_per_rev=10).segments[0].at_rest == at_rest


@pytest.mark.parametrize(
    "n, at_rest",
    [((0, 0, 0, 300, 700, 701), True), ((0, 0, 300, 700, 1100, 1101), False), ((0, 0, 0, 1, 2, 3), False)],
)
def test_a_driven_shaft_that_does_not_move_begins_at_rest(imported, n, at_rest):
    """For three rows, and where a speed too small to show in them is small beside those that show."""
    rows = "".join(f"{0.01 * k},5,{count}\n" for k, count in enumerate(n))
    assert imported("t_s,u_V,n\n" + rows, count="n", counts_per_rev=10).segments[0].at_rest == at_rest


@settings(max_examples=200)
@given(
    st.sampled_from([0.02, 0.005, 1 / 30, 1 / 7, 0.0012345, 17e-6, 3.0]),
    st.lists(st.integers(1, 3), min_size=3, max_size=200).filter(lambda steps: steps.count(1) * 2 > len(steps)),
    st.sampled_from([0.0, 1e-7, 0.1]),
    st.floats(0, 1e5),
)
def test_even_stamps_become_ticks(period, steps, rounded, start):
    ticks = np.cumsum([0, *steps])
    stamps = start + ticks * period
    if rounded:
        resolution = rounded * period
        stamps = np.rint(stamps / resolution) * resolution
    found = timing([stamps], rounded * period)
    assert found.ticks is not None and found.period_s is not None
    np.testing.assert_array_equal(found.ticks[0], ticks)
    assert abs(found.period_s - period) * ticks[-1] <= (rounded + 1e-6 + 1e-10 / period) * period


@given(st.integers(5, 200), st.integers(0, 100))
def test_uneven_stamps_stay_time(rows, seed):
    jitter = np.random.default_rng(seed).uniform(-1e-3, 1e-3, rows)
    stamps = np.arange(rows) * 0.02 + jitter
    stamps -= stamps[0]
    found = timing([stamps], 1e-6)
    assert found.ticks is None and found.period_s is None
    [segment] = from_arrays(time_s=stamps, volts=np.ones(rows), speed_rad_s=np.arange(rows) * 1.5).segments
    assert segment.tick is None
    np.testing.assert_array_equal(segment.time_s, stamps)


@pytest.mark.parametrize("jitter, even", [(5e-7, True), (2e-5, False)])
def test_even_is_to_a_millionth_of_the_period(jitter, even):
    stamps = np.arange(50) * 0.02
    stamps[17] += jitter * 0.02
    assert (timing([stamps]).ticks is not None) == even


def test_single_rows_have_no_period():
    assert timing([np.array([1.0]), np.array([2.0])]).period_s is None


@settings(max_examples=300)
@given(st.data())
def test_damaged_logs_are_a_recording_or_a_sentence(tmp_path_factory, data):
    text = bytearray(LOG.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 3))] = data.draw(
            st.sampled_from([b"", b",", b"\n", b"-", b"9", b'"', b"e", b";", b"\xff"])
        )
    path = tmp_path_factory.getbasetemp() / "damaged.csv"
    path.write_bytes(text)
    try:
        recording = import_log(path, speed="speed:rpm", segment=data.draw(st.sampled_from([None, "u_V"])))
        write(recording, path.with_suffix(".out"))
        assert isinstance(recording, Recording)
    except RecordingError as error:
        assert str(error).isprintable()


def test_measured_logs_of_one_lab():
    files = sorted(measured_data().glob("undcmotor_*/*.csv"))
    assert len(files) == 11
    for path in files:
        speed = "y_deg_per_s" in path.read_text()
        shaft = {"speed": "y_deg_per_s:deg/s", "speed_window_s": 0.02} if speed else {"angle": "y_deg:deg"}
        if path.name == "static_gain.csv":
            with pytest.raises(RecordingError, match="no column 't_s'"):
                import_log(path, **shaft)
            continue
        recording = import_log(path, **shaft)
        assert recording.period_s == 0.02 and lost_ticks(recording.segments[0]) == 0


def run(*flags):
    app = typer.Typer()
    app.command(name="import")(import_command)
    return CliRunner().invoke(app, list(map(str, flags)))


FLAGS = ("--time", "t_s", "--input", "u_V:V", "--speed", "speed:rpm", "--drive", "coast")


def test_command(tmp_path):
    log, out = tmp_path / "log.csv", tmp_path / "m1.csv"
    log.write_text(LOG)
    result = run(log, "-o", out, *FLAGS)
    assert result.exit_code == 0, result.output
    assert "5 rows in 1 segment, speed, one per 0.02 s, 0 ticks lost" in result.output
    assert same(read(out), import_log(log, speed="speed:rpm", time="t_s", drive="coast"))
    before = out.read_bytes()
    again = run(log, "-o", out, *FLAGS)
    assert isinstance(again.exception, JaxmotorError) and "--force" in str(again.exception)
    assert out.read_bytes() == before
    assert run(log, "-o", out, *FLAGS, "--force").exit_code == 0


def test_command_leaves_no_partial_output(tmp_path):
    log, out = tmp_path / "log.csv", tmp_path / "m1.csv"
    log.write_text(LOG.replace("0.04,3,0", "0.04,3"))
    assert isinstance(run(log, "-o", out, *FLAGS).exception, RecordingError)
    assert list(tmp_path.iterdir()) == [log]


@pytest.mark.parametrize(
    "flags",
    [(), FLAGS[:4], (*FLAGS, "--count", "n"), FLAGS[2:], (*FLAGS, "--units", "radians"), (*FLAGS, "--from", "sysid")],
)
def test_wrong_usage(tmp_path, flags):
    assert run(tmp_path / "log.csv", "-o", tmp_path / "m1.csv", *flags).exit_code == 2


def test_wrong_usage_says_which_columns_there_are(tmp_path):
    log = tmp_path / "log.csv"
    for text, there in (
        (LOG, "the log's columns are"),
        ("t_s,u_V,sp\x1b[31meed\n0,1,2\n1,2,3\n", "\\x1b[31meed"),
        ("0,1,2\n1,2,3\n", None),
        (None, None),
    ):
        if text is None:
            log.unlink()
        else:
            log.write_text(text)
        for flags in ((), FLAGS[:4]):
            result = run(log, "-o", tmp_path / "m1.csv", *flags)
            told = " ".join(result.output.replace("│", " ").split())
            assert result.exit_code == 2 and "state the" in told and "\x1b" not in told
            assert (there in told and "'u_V'" in told) if there else "the log's columns" not in told
    wide = ",".join(f"column_{k}" for k in range(3000))
    log.write_text(f"{wide}\n" + ",".join(["1"] * 3000) + "\n")
    assert len(run(log, "-o", tmp_path / "m1.csv").output) < 2000


def test_input_that_acted_before_its_row_is_moved_to_where_it_began(imported):
    text = "t,u,y,part\n" + "".join(f"{k},{10 * k},{k},{k // 3}\n" for k in range(6))
    flags = {"time": "t", "input": "u:V", "speed": "y:rad/s", "segment": "part"}
    after, before = imported(text, **flags), imported(text, input_acts="before", **flags)
    assert [segment.volts.tolist() for segment in after.segments] == [[0, 10, 20], [30, 40, 50]]
    assert [segment.volts.tolist() for segment in before.segments] == [[10, 20, 20], [40, 50, 50]]
    np.testing.assert_array_equal(before.segments[1].speed_rad_s, after.segments[1].speed_rad_s)
    duties = imported(text, input_acts="before", **(flags | {"input": "u:duty:100"}), supply_V=5.0)
    assert duties.segments[0].duty is not None and duties.segments[0].duty.tolist() == [10, 20, 20]
