"""Logs as people's programs write them: Arduino, MATLAB, ROS, Excel, numpy; wrapped counters, pulses, gaps."""

import numpy as np
import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from jaxmotor._errors import JaxmotorError
from jaxmotor.cli._import import import_command
from jaxmotor.recording import RecordingError, import_log, lost_ticks, read, write

DUTY = np.array([0, 0, 120, 120, -80, -80, 0, 0])
COUNT = np.array([70, 70, 70, 74, 83, 81, 72, 69])


@pytest.fixture
def imported(tmp_path):
    def of(text, **flags):
        path = tmp_path / "log.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        recording = import_log(path, **flags)
        write(recording, tmp_path / "written.csv")
        again = read(tmp_path / "written.csv")
        for one, other in zip(recording.segments, again.segments, strict=True):
            np.testing.assert_array_equal(one.time_s, other.time_s)
            np.testing.assert_array_equal(one.volts, other.volts)
        return recording

    return of


@pytest.fixture
def refused(imported):
    def of(text, **flags):
        with pytest.raises(RecordingError) as caught:
            imported(text, **flags)
        sentence = str(caught.value)
        assert "\n" not in sentence and len(sentence) < 400
        return sentence

    return of


def rows(line, numbers=range(8)):
    return "".join(line.format(k=k, t=0.01 * k, d=int(DUTY[k]), n=int(COUNT[k])) for k in numbers)


def check(recording, ticks=range(8), numbers=range(8)):
    (segment,) = recording.segments
    assert recording.period_s == pytest.approx(0.01, rel=1e-12)
    np.testing.assert_array_equal(segment.tick, ticks)
    np.testing.assert_array_equal(segment.duty, DUTY[list(numbers)])
    np.testing.assert_allclose(segment.volts, DUTY[list(numbers)] / 255 * 7.4, rtol=1e-15)
    np.testing.assert_array_equal(segment.count - segment.count[0], COUNT[list(numbers)] - COUNT[next(iter(numbers))])


RIG = {"counts_per_rev": 600, "supply_V": 7.4}
STATED = {"time": "t", "input": "duty:duty:255", "count": "count"} | RIG


def test_no_time_column(imported, refused):
    text, stated = "".join(f"{d},{n}\n" for d, n in zip(DUTY, COUNT, strict=True)), STATED | {"columns": "duty,count"}
    del stated["time"]
    recording = imported(text, **stated, period_s=0.01)
    check(recording)
    assert recording.header["imported"]["period_s"] == 0.01
    whole = imported(text.replace("\n-80,81", "\nnan,81"), **stated, period_s=0.01)
    check(whole, ticks=[0, 1, 2, 3, 4, 6, 7], numbers=[0, 1, 2, 3, 4, 6, 7])
    assert "period_s is 0; it is a positive number" in refused(text, **stated, period_s=0)
    for period_s in (1e300, 1e-300):
        assert "rows are 1e-08 to 10000 s apart" in refused(text, **stated, period_s=period_s)
    assert "state one of them" in refused(text, **stated, time="duty", period_s=0.01)
    assert "period_s where rows are evenly spaced" in refused(text, **stated)


def test_line_ends(imported):
    plain = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
    for end in ("\r\n", "\r\r\n"):
        check(imported(plain.replace("\n", end), **STATED))


STYLES = {
    "Arduino, Serial.println, milliseconds, no names": (
        rows("{k}0,{d},{n}\r\n"),
        STATED | {"columns": "t,duty,count", "time": "t:ms"},
    ),
    "Arduino, microseconds, blanks after commas": (
        "t, duty, count\n" + rows("{k}0000, {d}, {n}\n"),
        STATED | {"time": "t:us"},
    ),
    "Arduino, tabs, a boot message as comment": (
        "# motor test v3, " + "\u00b5" + "s\n" + rows("{t:.2f}\t{d}\t{n}\n"),
        STATED | {"columns": "t,duty,count"},
    ),
    "Arduino, the first row is cut": (
        "0,70\n" + rows("{t:.2f},{d},{n}\n"),
        STATED | {"columns": "t,duty,count", "drop_first": 1},
    ),
    "MATLAB, writetable": ("t,duty,count\n" + rows("{t:.15g},{d},{n}\n"), STATED),
    "MATLAB, comments of its own": ("% bench 2\nt,duty,count\n" + rows("{t:.15g},{d},{n}\n"), STATED),
    "a row of units": ("t;duty;count\ns;1;1\n" + rows("{t:.2f};{d};{n}\n"), STATED | {"drop_first": 1}),
    "pandas, counts that were floats": (
        ",t,duty,count\n" + rows("{k},{t:.2f},{d}.0,{n}.0\n"),
        STATED,
    ),
    "ROS, rostopic echo -p": (
        "%time,field.duty,field.count\n" + rows("17000000001{k}0000000,{d},{n}\n"),
        STATED | {"time": "time:ns", "input": "field.duty:duty:255", "count": "field.count"},
    ),
    "ROS, seconds since 1970": (
        "rosbagTimestamp,duty,count\n" + rows("1700000000.1{k}0000123,{d},{n}\n"),
        STATED | {"time": "rosbagTimestamp"},
    ),
    "Excel, semicolons and decimal commas": (
        "\ufeffsep=;\r\nt;duty;count\r\n" + rows("{t:.2f};{d};{n}\r\n").replace(".", ","),
        STATED | {"decimal_comma": True},
    ),
    "Excel, trailing names and quotes": (
        '"t";"duty";"count"\r\n' + rows('"{t:.2f}";"{d}";"{n},0"\r\n').replace(".", ","),
        STATED | {"decimal_comma": True},
    ),
    "quotes between commas, and decimal commas in them": (
        "t,duty,count\r\n"
        + "".join(f'"0,0{k}","{d}","{n},0"\r\n' for k, (d, n) in enumerate(zip(DUTY, COUNT, strict=True))),
        STATED | {"decimal_comma": True},
    ),
    "quotes between semicolons, decimal commas in them, no names": (
        rows('"{t:.2f}";"{d}";"{n},0"\r\n').replace(".", ","),
        STATED | {"decimal_comma": True, "columns": "t,duty,count"},
    ),
    "PuTTY's log": (
        "=~=~=~=~=~= PuTTY log 2026.01.30 12:22:11 =~=~=~=~=~=\r\nt,duty,count\r\n" + rows("{t:.2f},{d},{n}\r\n"),
        STATED,
    ),
    "numpy.savetxt": (
        "# t duty count\n" + rows("{t:.18e} {d:.18e} {n:.18e}\n"),
        STATED,
    ),
    "numpy.savetxt, names with commas above blanks": (
        "# t,duty,count\n" + rows("{t:.18e} {d:.18e} {n:.18e}\n"),
        STATED,
    ),
    "names in a comment": ("# bench 2\n#t,duty,count\n" + rows("{t:.2f},{d},{n}\n"), STATED),
    "aligned with blanks": ("t  duty count\n" + rows("{t:5.2f} {d:5d} {n:5d}\n"), STATED),
}


@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
def test_styles(imported, style):
    text, flags = style
    check(imported(text, **flags))


def test_a_stale_first_row_is_dropped_in_each_segment(imported):
    text = "t,duty,count,part\n" + "".join(
        f"{0.01 * k:.2f},{DUTY[k % 8] if k % 8 else 99},{COUNT[k % 8] if k % 8 else 12345},{k // 8}\n"
        for k in range(16)
    )
    recording = imported(text, **STATED, segment="part", drop_first=1)
    assert [segment.count.tolist() for segment in recording.segments] == [COUNT[1:].tolist()] * 2
    assert [segment.duty.tolist() for segment in recording.segments] == [DUTY[1:].tolist()] * 2
    assert [segment.start_s for segment in recording.segments] == [0, pytest.approx(0.08)]


@pytest.mark.parametrize("bits", [8, 12, 16, 24, 32, 56])
@pytest.mark.parametrize("signed", [False, True])
@given(data=st.data())
def test_wrapped_counters_run_on(tmp_path_factory, bits, signed, data):
    size = 2**bits
    steps = data.draw(st.lists(st.integers(-min(3 * size // 8, 2**20), min(3 * size // 8, 2**20)), min_size=3))
    start = data.draw(st.integers(-(2**20), 2**20))
    true = start + np.cumsum([0, *steps])
    logged = true % size
    logged = np.where(logged >= size // 2, logged - size, logged) if signed else logged
    path = tmp_path_factory.getbasetemp() / "wrapped.csv"
    path.write_text("t,u,n\n" + "".join(f"{k},{k},{n}\n" for k, n in enumerate(logged.tolist())))
    recording = import_log(path, time="t", input="u:V", count="n", counts_per_rev=600, wrap=bits)
    np.testing.assert_array_equal(np.diff(recording.segments[0].count), steps)


def test_an_angle_within_one_turn_runs_on(imported):
    true = np.cumsum([0, 100, 130, 120, 90, -20, -130, -110, -130.5, 0])
    text = "t,u,y\n" + "".join(f"{k},{k},{y % 360}\n" for k, y in enumerate(true))
    angle = imported(text, time="t", input="u:V", angle="y:deg", wrap="turn").segments[0].angle_rad
    np.testing.assert_allclose(np.degrees(angle), true, atol=1e-9)


def test_pulses_add_up(imported):
    pulses = np.diff(COUNT, prepend=COUNT[0] - 5)
    text = "t,duty,n\n" + "".join(f"{0.01 * k:.2f},{DUTY[k]},{pulses[k]}.0\n" for k in range(8))
    recording = imported(text, **(STATED | {"count": None, "pulses": "n"}))
    check(recording)
    assert recording.segments[0].at_rest and not recording.count_resets


def test_pulses_that_were_lost_are_not_made_up(imported):
    pulses = np.diff(COUNT, prepend=COUNT[0])
    text = "t,duty,n\n" + "".join(f"{0.01 * k:.2f},{DUTY[k]},{pulses[k]}\n" for k in range(8) if k != 4)
    recording = imported(text, **(STATED | {"count": None, "pulses": "n"}))
    assert recording.count_resets and lost_ticks(recording.segments[0]) == 1


@pytest.mark.parametrize(
    "above", ["ready\n", "ets Jun  8 2016 00:22:57\n\nrst:0x1 (POWERON_RESET),boot:0x13\nready\n", "1,2\n"]
)
def test_what_a_board_prints_as_it_starts_stands_above_the_names(imported, above):
    recording = imported(above + "t,duty,count\n" + rows("{t:.2f},{d},{n}\n"), **STATED)
    check(recording, range(8), range(8))
    assert recording.header["imported"]["lines_above"] == above.count("\n")
    commented = imported(above + "# t,duty,count\n" + rows("{t:.2f},{d},{n}\n"), **STATED)
    check(commented, range(8), range(8))
    assert commented.header["imported"]["lines_above"] == above.count("\n")


UNNAMED = STATED | {"columns": "t,duty,count"}


PREAMBLE = "+++ Header +++\n\nspeed limit (deg/s): 1080, 2000\n--- log ---\n"


@pytest.mark.parametrize(
    ("above", "drop", "stale"), [(PREAMBLE, 0, ""), ("a,b,c,d\n", 0, ""), (PREAMBLE, 1, "0,0,0\n")]
)
def test_what_a_board_prints_stands_above_rows_without_names(imported, above, drop, stale):
    log = above + stale + rows("{t:.2f},{d},{n}\n")
    recording = imported(log, **UNNAMED, drop_first=drop)
    check(recording, range(8), range(8))
    assert recording.header["imported"]["lines_above"] == above.count("\n")


def test_a_stale_row_is_none_of_the_lines_above(imported):
    recording = imported("7,x\n" + rows("{t:.2f},{d},{n}\n"), **UNNAMED, drop_first=1)
    check(recording, range(8), range(8))
    assert "lines_above" not in recording.header["imported"]


@pytest.mark.parametrize(
    ("above", "reason"),
    [("t,duty,count\n", "names the columns already"), ("7,1\n", "2 fields where the columns are 3")],
)
def test_names_and_damaged_rows_are_no_lines_above(refused, above, reason):
    assert "line 1: " in (said := refused(above + rows("{t:.2f},{d},{n}\n"), **UNNAMED)) and reason in said


@pytest.mark.parametrize("endless", ["x" * 200_000, '"' + "y," * 100_000])
def test_an_endless_line_is_damage(imported, refused, endless):
    log = rows("{t:.2f},{d},{n}\n")
    check(imported(f"{endless}\n{log}", **UNNAMED), range(8), range(8))
    assert "line 9: " in refused(f"{log}{endless}\n", **UNNAMED)


@pytest.mark.parametrize("names", ["", "t;duty;count\n", "# t;duty;count\n"])
def test_rows_may_end_with_what_separates_their_numbers(imported, names):
    recording = imported(names + rows("{t:.2f};{d};{n};\n"), **(STATED if names else UNNAMED))
    check(recording, range(8), range(8))


MATRIX = "{k} {t:.2f} {d} {n};\n"
WORDS = {"time": "Time", "input": "Control Effort:duty:255", "count": "Encoder 1 Pos"} | RIG


@pytest.mark.parametrize("mark", [",", " ", "\t"])
@pytest.mark.parametrize("names", ["t,duty,count", "% t,duty,count", "% rig,day\n% t,duty,count\n% [s],[1],[counts]"])
def test_rows_may_end_as_those_of_a_matrix_and_units_stand_below_the_names(imported, mark, names):
    lines = names + "\n" + rows("{t:.2f},{d},{n}; \n")
    check(imported(lines.replace(",", mark), **STATED))


@pytest.mark.parametrize(("unit", "period_s"), [("10ms", 0.01), ("0.125ms", 1.25e-4), ("2e6ns", 2e-3)])
def test_the_time_may_be_a_number_of_ticks(imported, unit, period_s):
    log = "t,duty,count\n" + rows("{k},{d},{n}\n")
    assert imported(log, **STATED | {"time": f"t:{unit}"}).period_s == pytest.approx(period_s, rel=1e-12)


def test_names_that_are_more_than_the_columns_are_told(refused):
    told = "3 fields where the columns are 4; all rows are so: name their columns with columns"
    assert told in refused("t,duty,count,state\n" + rows("{t:.2f},{d},{n}\n"), **STATED)


@pytest.mark.parametrize("end", ["]", "];", " ] ; ", ";\n]", ";\n];\n"])
@pytest.mark.parametrize("begin", ["[", "data = [", "data =[   ", "data = [\n"])
@pytest.mark.parametrize("mark", [" ", ", ", "\t"])
def test_a_matrix_in_matlabs_words_needs_no_editing(imported, begin, end, mark):
    text = begin + rows(MATRIX.replace(" ", mark)).rstrip().removesuffix(";") + end
    check(imported(text, columns="n,t,duty,count", **STATED))


@pytest.mark.parametrize("comment", ["", "% "])
@pytest.mark.parametrize("blank", ["", "\n", "\r\n"])
def test_between_blanks_names_may_be_several_words(imported, comment, blank):
    names = f"{comment}Sample   Time     Control Effort   Encoder 1 Pos\n{blank}"
    check(imported(names + rows("  {k}  {t:.2f}   {d}  {n}\n"), **WORDS))
    check(imported(names + "[" + rows("  {k}  {t:.2f}   {d}  {n};\n").rstrip().removesuffix(";") + "];\n", **WORDS))


def test_what_is_damaged_in_a_matrix_is_told_by_its_line(refused):
    whole = "% Sample   Time   Control Effort   Encoder 1 Pos\ndata = [" + rows(MATRIX).rstrip() + "\n];\n"
    assert "line 5:" in (told := refused(whole.replace("3 0.03 120 74", "3 0.03 120"), **WORDS)) and "3 fields" in told
    assert "line 5: Time is 'x'" in refused(whole.replace("3 0.03", "3 x"), **WORDS)


@pytest.mark.parametrize(
    "text", [rows("[{k}, {t:.2f}, {d}, {n}]\n"), "[" + rows(MATRIX), rows(MATRIX) + "]", "[\n]", "[]"]
)
def test_other_brackets_are_no_matrix(refused, text):
    assert refused(text, columns="n,t,duty,count", **STATED).split(":")[0].split(",")[0].endswith("log.csv")


def test_a_board_may_print_brackets_above_its_rows(imported):
    check(imported("[boot] ready\nt,duty,count\n" + rows("{t:.2f},{d},{n}\n"), **STATED))


def test_a_last_column_that_is_empty_stays_one(imported, refused):
    check(imported("t,duty,count,left\n" + rows("{t:.2f},{d},{n},\n"), **STATED), range(8), range(8))
    log = "t,duty,count\n" + rows("{t:.2f},{d},{n},\n").replace("0.02,", "0.02,0,")
    assert "where the columns are 3" in refused(log, **STATED)


@pytest.mark.parametrize("end", ["0", "0.08,7", "0.08,", "t:0.08,duty:7"])
def test_a_last_line_that_is_cut_is_left_out_and_told(imported, end):
    """A capture that was ended in the middle of a line."""
    named = "t:" in end
    log = rows("t:{t:.2f},duty:{d},count:{n}\n") if named else "t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
    recording = imported(log + end, **STATED)
    check(recording, range(8), range(8))
    assert recording.header["imported"]["cut_lines"] == 1
    for whole in (log, log.rstrip("\n")):
        assert "cut_lines" not in imported(whole, **STATED).header["imported"]


def test_a_short_line_that_ends_is_no_cut_one(refused):
    log = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
    assert "line 10: 2 fields where the columns are 3; correct or delete it" in refused(log + "0.08,7\n", **STATED)


def test_numbers_that_come_again_are_no_names(refused):
    """Names before each number, with the same mark between all: they are columns, too."""
    log = (
        rows("t,{t:.2f},duty,{d},count,{n},left,0\n").replace("duty,0", "duty,0.00").replace("count,0,", "count,0.00,")
    )
    assert "numbers where the column names are expected; put names above them" in refused(log, **STATED)


def test_names_that_come_again_leave_no_rows_out(refused):
    """A board that starts anew: which rows count is the user's to say."""
    log = "# t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
    assert "line 10: t is '# t', not a finite number; correct or delete the row" in refused(log + log, **STATED)


def test_names_are_sought_only_where_a_row_follows_and_all_are_there(imported):
    log = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
    assert "lines_above" not in imported(log, **STATED).header["imported"]
    with pytest.raises(RecordingError, match="line 1: "):
        imported("ready\n" + log.replace("count", "counts"), **STATED)
    with pytest.raises(RecordingError, match="line 1: "):
        imported("ready\n" + log.replace("count\n", "count\n\n"), **STATED)


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", " "])
@pytest.mark.parametrize("column", ["duty", "count"])
def test_missing_cells_are_skipped_ticks(imported, cell, column):
    for gone in (3, 4):
        line = {
            "duty": f"{0.01 * gone:.2f},{cell},{COUNT[gone]}\n",
            "count": f"{0.01 * gone:.2f},{DUTY[gone]},{cell}\n",
        }
        text = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n", range(gone)) + line[column]
        text += rows("{t:.2f},{d},{n}\n", range(gone + 1, 8))
        kept = [k for k in range(8) if k != gone]
        recording = imported(text, **STATED)
        check(recording, kept, kept)
        assert recording.header["imported"]["missing_rows"] == 1


def test_between_uneven_rows_a_gap_begins_a_segment(imported):
    times = [0, 0.011, 0.02, 0.034, 0.04, 0.051, 0.06, 0.0713]
    cells = [f"{t},{'nan' if k in (2, 3, 6) else k},{10 * k}\n" for k, t in enumerate(times)]
    recording = imported("t,u,y\n" + "".join(cells), time="t", input="u:V", speed="y:rad/s")
    assert recording.period_s is None
    assert [part.volts.tolist() for part in recording.segments] == [[0, 1], [4, 5], [7]]
    assert [part.start_s for part in recording.segments] == pytest.approx([0, 0.04, 0.0713])
    assert not any(part.at_rest for part in recording.segments[1:])


def test_an_input_that_acted_before_a_gap_stays_with_its_row(imported):
    text = "t,u,y\n0,5,0\n1,6,1\n2,7,nan\n3,8,3\n4,nan,4\n5,10,5\n"
    recording = imported(text, time="t", input="u:V", speed="y:rad/s", input_acts="before")
    (part,) = recording.segments
    # Row 1 is followed by what row 2 says was applied until then; row 3 by a gap, since row 4 does not know.
    assert part.tick.tolist() == [0, 1, 4, 5] and part.volts.tolist() == [6, 7, 10, 10]


def test_time_stamps_keep_every_digit(imported):
    ticks = [0, 1, 2, 3, 5, 6]
    text = "t,u,y\n" + "".join(f"{1_700_000_000_000_000_000 + 1_000_003 * k},{k},{k}\n" for k in ticks)
    recording = imported(text, time="t:ns", input="u:V", speed="y:rad/s")
    assert recording.period_s == 1_000_003e-9 and recording.segments[0].tick.tolist() == ticks
    jittered = [0, 10_000_017, 20_000_001, 30_000_450]
    text = "t,u,y\n" + "".join(f"1700000000.{k:09d},1,{k}\n" for k in jittered)
    times = imported(text, time="t", input="u:V", speed="y:rad/s").segments[0].time_s
    np.testing.assert_allclose(times, np.array(jittered) * 1e-9, rtol=0, atol=1e-16)


def test_a_supply_that_nobody_knows(imported):
    text = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
    recording = imported(text, **(STATED | {"supply_V": None, "supply_unknown": True}))
    np.testing.assert_allclose(recording.segments[0].volts, DUTY / 255)
    assert recording.supply_V == 1.0 and recording.header["supply_unknown"] is True


PULSED = {"count": None, "pulses": "count"}
PLAIN = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n")
BARE = rows("{t:.2f},{d},{n}\n")


@pytest.mark.parametrize(
    "text, flags, reason",
    [
        (PLAIN.replace("74", "74.5"), {}, "not whole"),
        (PLAIN.replace(",74", ",7.40000e+06"), {}, "line 5: count is '7.40000e+06', whose last digits"),
        (BARE, {}, "columns"),
        (BARE, {"columns": "t,duty"}, "3 fields, and columns names 2"),
        (BARE, {"columns": "t,duty,t"}, "stands twice"),
        (PLAIN, {"columns": "t,duty,count"}, "leave columns out"),
        (BARE, {"columns": "t,duty,n"}, "no column 'count'"),
        ("0,70\n" + BARE, {"columns": "t,duty,count"}, "line 1: 2 fields"),
        ("t,duty,count\n0,7\n" + BARE, {}, "line 2: 2 fields where the columns are 3; correct it, or leave it out"),
        (BARE, {"columns": "t,duty,count", "drop_first": 8}, "no rows"),
        (PLAIN, {"drop_first": 8}, "rows are needed"),
        (PLAIN, {"drop_first": -1}, "drop_first is -1"),
        (PLAIN, {"wrap": 1}, "wrap is 1"),
        (PLAIN, {"wrap": "turn"}, "belongs to angle"),
        (PLAIN, {"wrap": 6}, "line 6: count is 83, more than a counter of 6 bit"),
        (PLAIN.replace(",83", ",127"), {"wrap": 7}, "line 6: a counter of 7 bit moves by 41%"),
        (PLAIN, {"count": None, "angle": "count:deg", "wrap": 16}, "belongs to count"),
        (PLAIN.replace(",83", ",800"), {"count": None, "angle": "count:deg", "wrap": "turn"}, "beyond one turn"),
        (PLAIN, {"pulses": "count"}, "exactly one of"),
        (BARE + "0.0\n", {"columns": "t,duty,count"}, "line 9: 1 field where the columns are 3"),
        (PLAIN, {"count": None, "pulses": "count", "wrap": 16}, "belongs to count"),
        (PLAIN, {"count": None, "pulses": "count", "counts_per_rev": None}, "counts_per_rev"),
        (PLAIN.replace("74", "74.5"), PULSED, "not whole"),
        ("t,duty,count\n" + "".join(f"{k},1,{9 * 10**16}\n" for k in range(99)), PULSED, "more counts"),
        (PLAIN, {"supply_unknown": True}, "leave supply_unknown out"),
        (PLAIN, {"supply_V": None}, "supply_unknown"),
        (PLAIN, {"supply_V": None, "supply_unknown": True, "input": "duty:V"}, "leave supply_unknown out"),
        (PLAIN, {"decimal_comma": True}, "not clear"),
        (
            PLAIN.replace(",", ";").replace(";74", ";1.000,5"),
            {"decimal_comma": True},
            "line 2: t is '0.00', with a point",
        ),
        (PLAIN.replace("70\n", "nan\n").replace("0.0", "0.1"), {"input": "count:V", "count": "duty"}, None),
        ("t,duty,count\n0,1,nan\n1,nan,2\n", {}, "no row has both"),
        ("t,duty,count\nnan,1,1\n1,1,2\n", {}, "line 2: t is 'nan'"),
        ("t,duty,count\n" + "1" * 18 + ",1,1\nx,1,2\n", {}, "line 3: t is 'x'"),
        ("t,duty,count\n1,1,1\n2_000_000_000_000_000,1,2\n", {}, "line 3: t is"),
        ("t,duty,count\n1,1,1\n" + "9" * 30 + ",1,2\n", {}, "line 3: t is 1e+30, more than"),
    ],
)
def test_what_does_not_fit_is_a_sentence(refused, imported, text, flags, reason):
    if reason is None:
        assert imported(text, **(STATED | flags)).header["imported"]["missing_rows"] == 3
    else:
        assert reason in refused(text, **(STATED | flags))


def test_a_segment_without_whole_rows_is_refused(refused):
    text = "t,duty,count,part\n0,1,1,a\n1,1,2,a\n2,1,nan,b\n3,1,,b\n4,1,5,c\n"
    assert "a segment has no row" in refused(text, **STATED, segment="part")
    assert "line 6: drop_first 2" in refused(
        text.replace("nan", "3").replace(",,", ",4,"), **STATED, segment="part", drop_first=2
    )


def run(*flags):
    app = typer.Typer()
    app.command(name="import")(import_command)
    return CliRunner().invoke(app, list(map(str, flags)))


def test_command(tmp_path):
    log, out = tmp_path / "log.csv", tmp_path / "m1.csv"
    log.write_text("999;1\n" + rows("{t:.2f};{d};{n},0\n").replace(".", ",").replace(";83,0", ";"))
    flags = ("--time", "t", "--input", "d:duty:255", "--count", "n", "--wrap", "16", "--columns", "t,d,n")
    flags += ("--drop-first", 1, "--decimal-comma", "--counts-per-rev", 600)
    result = run(log, "-o", out, *flags, "--supply", 7.4)
    assert result.exit_code == 0, result.output
    assert (
        "7 rows in 1 segment, count, one per 0.01 s, 1 ticks lost; 1 row without input or shaft is a gap"
        in result.output
    )
    assert lost_ticks(read(out).segments[0]) == 1
    assert run(log, "-o", out, *flags, "--supply-unknown", "--force").exit_code == 0
    assert read(out).header["supply_unknown"] is True
    before = out.read_bytes()
    refused = run(log, "-o", out, *flags, "--force")
    assert isinstance(refused.exception, JaxmotorError) and "--supply" in str(refused.exception)
    assert out.read_bytes() == before


@pytest.mark.parametrize(
    "flags", [("--wrap", "x"), ("--wrap", "-8"), ("--drop-first", "-1"), ("--pulses", "n"), ("--from", "sysid")]
)
def test_wrong_usage(tmp_path, flags):
    given = ("--time", "t", "--input", "u:V", "--count", "n", "--counts-per-rev", 5)
    result = run(tmp_path / "log.csv", "-o", tmp_path / "m1.csv", *given, *flags)
    assert result.exit_code == 2


@pytest.mark.parametrize("line", ["t:{t:.2f},duty:{d},count:{n}\n", "t:{t:.2f}\tduty:{d}\tcount:{n}\n"])
def test_names_before_each_number_as_plotters_want_them(imported, line):
    check(imported(rows(line), **STATED))


@pytest.mark.parametrize(
    "line",
    [
        "t: {t:.2f}s, duty: {d} %, count: {n}\n",
        "t={t:.2f} duty={d} count={n}\n",
        "t: {t:.2f} duty: {d} count: {n}\n",
        "t = {t:.2f}s | duty = {d}% | count = {n}\n",
    ],
)
def test_names_and_units_as_people_read_them(imported, line):
    check(imported(rows(line), **STATED))
    begun = "=~=~= PuTTY log 2021.12.19 16:06:17 =~=~=\nready\n7A, count: 3\n" + rows(line)
    assert imported(begun, **STATED).header["imported"]["lines_above"] == 2


def test_a_name_of_several_words_is_a_column(imported):
    text = rows("Run Time: {t:.2f}s, PWM Percent: {d}%, Count: {n}\n")
    named = {"time": "Run Time", "input": "PWM Percent" + STATED["input"].removeprefix("duty"), "count": "Count"}
    check(imported(text, **{**STATED, **named}))


def test_a_cell_of_many_digits_is_refused_at_once(refused):
    """With as many ways to read it as it has digits, squared, this would take hours."""
    many = "1" * 300_000
    labelled = rows("t:{t:.2f},duty:{d},count:{n}\n") + f"t:0.20,duty:3,count:{many}=\n"
    plain = "t,duty,count\n" + rows("{t:.2f},{d},{n}\n") + f"0.20,3,{many}x\n"
    for text in (labelled, plain):
        assert len(refused(text, **STATED)) < 500


def test_a_unit_that_changes_is_refused(refused):
    text = rows("t: {t:.2f}s, duty: {d} %, count: {n}\n")
    assert "line 3: t has the unit 'ms', and 's' elsewhere" in refused(text.replace("0.02s", "0.02ms"), **STATED)


def test_a_torn_first_line_of_a_plotters_log_is_left_out(imported):
    torn = "ty:0,count:70\n" + rows("t:{t:.2f},duty:{d},count:{n}\n")
    check(imported(torn, **STATED, drop_first=1))


def test_a_line_with_other_names_is_refused(refused):
    text = rows("t:{t:.2f},duty:{d},count:{n}\n")
    assert "line 3: the names t, duty, count" in refused(text.replace("t:0.02,duty", "t:0.02,dut"), **STATED)
    assert "leave columns out" in refused(text, **STATED, columns="t,duty,count")


def test_the_times_of_day_of_a_serial_monitor_are_left_out(imported):
    check(imported("12:00:00.000 -> t,duty,count\n" + rows("12:00:00.0{k}1 -> {t:.2f},{d},{n}\n"), **STATED))
    check(imported(rows("9:59:59 -> {t:.2f} {d} {n}\n"), **STATED, columns="t,duty,count"))
