"""SysId's JSON, of both generations, and a CSV exported from a robot's data log."""

import json

import numpy as np
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from jaxmotor.cli._import import import_command
from jaxmotor.recording import Recording, RecordingError, import_sysid, read

KEYS = ("slow-forward", "slow-backward", "fast-forward", "fast-backward")


def rows_of_test(start, sign, width=4, order=(0, 1, 2, 3)):
    """Ten rows [s, V, turn, turn/s] of a motor that turns with the voltage."""
    table = np.zeros((10, width))
    time = np.arange(10) * 0.005
    for column, values in zip(order, (start + time, sign * time * 100, sign * time**2, sign * 2 * time), strict=True):
        table[:, column] = values
    return table.tolist()


def log(**changes):
    tests = {key: rows_of_test(10.0 * k, 1 if "forward" in key else -1) for k, key in enumerate(KEYS)}
    return {"sysid": True, "test": "Simple", "units": "Meters", "unitsPerRotation": 0.3, **tests, **changes}


@pytest.fixture
def imported(tmp_path):
    def of(values, name="log.json", **flags):
        path = tmp_path / name
        path.write_text(values if isinstance(values, str) else json.dumps(values))
        return import_sysid(path, **flags)

    return of


@pytest.fixture
def refused(imported):
    def of(*args, **flags):
        with pytest.raises(RecordingError) as caught:
            imported(*args, **flags)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return of


def test_json(imported):
    recording = imported(log())
    assert [part.kind for part in recording.segments] == ["ramp", "ramp", "step", "step"]
    assert [part.parameters["label"] for part in recording.segments] == [
        *("quasistatic-forward", "quasistatic-reverse"),
        *("dynamic-forward", "dynamic-reverse"),
    ]
    assert [part.start_s for part in recording.segments] == [0, 10, 20, 30]
    assert recording.period_s == 0.005 and recording.measured == "angle"
    # The file holds turns, whatever its units say.
    np.testing.assert_allclose(recording.segments[1].angle_rad, -2 * np.pi * (np.arange(10) * 0.005) ** 2)
    np.testing.assert_allclose(recording.segments[1].volts, -np.arange(10) * 0.5)
    assert recording.header["imported"]["unitsPerRotation"] == 0.3


def test_tests_come_in_order_of_time(imported):
    recording = imported(log(**{"slow-forward": rows_of_test(50.0, 1), "fast-backward": []}))
    assert [part.parameters["label"] for part in recording.segments][-1] == "quasistatic-forward"
    assert len(recording.segments) == 3


def test_unsigned_voltage_gets_the_sign_of_the_velocity(imported):
    rows = [[time, abs(volts), turn, speed] for time, volts, turn, speed in rows_of_test(30.0, -1)]
    recording = imported(log(**{"fast-backward": rows}))
    np.testing.assert_allclose(recording.segments[3].volts, -np.arange(10) * 0.5)
    assert [part.parameters.get("voltage_sign") for part in recording.segments] == [None, None, None, "turned"]


def test_velocity_where_no_position_was_logged(imported):
    still = {key: [[t, u, 0.0, v] for t, u, _, v in rows] for key, rows in log().items() if key in KEYS}
    recording = imported(log(**still))
    assert recording.measured == "speed" and recording.speed_window_s is None
    np.testing.assert_allclose(recording.segments[0].speed_rad_s, 4 * np.pi * np.arange(10) * 0.005)


@pytest.mark.parametrize("side, order", [("left", (0, 1, 3, 5)), ("right", (0, 2, 4, 6))])
def test_drivetrain(imported, refused, side, order):
    values = log(
        test="Drivetrain", **{key: rows_of_test(0.0, 1, 9, order) for key in KEYS[:1]}, **{key: [] for key in KEYS[1:]}
    )
    assert imported(values, motor=side).segments[0].volts[9] == pytest.approx(4.5)
    assert "motor left" in refused(values)
    other = {"left": "right", "right": "left"}[side]
    assert not imported(values, motor=other).segments[0].volts.any()


def test_the_oldest_format(imported):
    values = log(**{key: rows_of_test(0.0, 1, 10, (0, 3, 5, 7)) for key in KEYS[:1]}, **{key: [] for key in KEYS[1:]})
    del values["sysid"]
    assert imported(values).segments[0].volts[9] == pytest.approx(4.5)


BAD_JSON = {
    "not JSON": ('{"slow-forward": [\n[1, 2,', "line 2"),
    "list": ("[1, 2]", "no SysId log"),
    "number": ("7", "no SysId log"),
    "other keys": ('{"a": 1}', "no SysId log"),
    "no rows": (json.dumps(log(**{key: [] for key in KEYS})), "has rows"),
    "nested": ("[" * 100_000, "nested"),
    "NaN": ('{"slow-forward": [[0, NaN, 0, 0]]}', "finite"),
    "width": (json.dumps(log(**{"slow-forward": [[0, 1, 2]]})), "row 0 of 'slow-forward' is not 4 numbers"),
    "text": (json.dumps(log(**{"slow-forward": [[0, 1, 2, "3"]]})), "not 4 numbers"),
    "bool": (json.dumps(log(**{"slow-forward": [[0, 1, 2, True]]})), "not 4 numbers"),
    "rows": (json.dumps(log(**{"slow-forward": {"a": 1}})), "not a list of rows"),
    "huge": (json.dumps(log(**{"slow-forward": [[0, 1, 2, 10**400]]})), "beyond"),
    "infinite": ('{"sysid": true, "slow-forward": [[0, 1, 2, 1e999]]}', "beyond"),
    "digits": ('{"slow-forward": [[' + "9" * 5000 + "]]}", "finite"),
    "time": (json.dumps(log(**{"slow-forward": [[0, 1, 2, 3], [0, 1, 2, 3]]})), "row 1 of 'slow-forward'"),
    "angular": (json.dumps(log(test="Drivetrain (Angular)")), "on the spot"),
}


@pytest.mark.parametrize("bad", BAD_JSON.values(), ids=BAD_JSON)
def test_bad_json(refused, bad):
    text, reason = bad
    assert reason in refused(text)


def test_options_that_do_not_fit(refused):
    assert "units" in refused(log(), units="meters")
    assert "one motor only" in refused(log(), motor="left")


@settings(max_examples=150)
@given(st.data())
def test_damaged_json_is_a_recording_or_a_sentence(tmp_path_factory, data):
    text = bytearray(json.dumps(log()).encode())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 40))] = data.draw(
            st.sampled_from([b"", b"[", b"]", b"9", b'"', b"e9", b"\0"])
        )
    path = tmp_path_factory.getbasetemp() / "damaged.json"
    path.write_bytes(text)
    try:
        assert isinstance(import_sysid(path), Recording)
    except RecordingError as error:
        assert str(error).isprintable()


NAMES = "Timestamp,NT:/voltage-left-drive,position-left-drive,velocity-left-drive,/sysid-test-state-drive"
SPARSE = f"""\
{NAMES}
0.000000,0.0,,,none
0.000020,,0.00,,
0.020000,1.0,,,quasistatic-forward
0.020030,,0.25,,
0.020050,,,3.0,
0.040000,2.0,,,
0.040030,,0.50,,
0.060000,0.0,,,none
0.060030,,0.75,,
0.080000,7.0,,,dynamic-reverse
0.080030,,0.75,,
0.100000,,,4.0,
0.120010,,1.00,,
"""


def test_sparse_csv(imported):
    recording = imported(SPARSE, "log.csv", units="rotations")
    assert [part.kind for part in recording.segments] == ["ramp", "step"]
    assert [part.parameters["label"] for part in recording.segments] == ["quasistatic-forward", "dynamic-reverse"]
    ramp, step = recording.segments
    assert ramp.volts.tolist() == [1, 2] and step.volts.tolist() == [7, 7]
    np.testing.assert_allclose(ramp.angle_rad, [np.pi / 2, np.pi])
    assert step.start_s == pytest.approx(0.06)
    # The round at 0.1 s logged no position: its time is a gap.
    np.testing.assert_allclose(step.time_s, [0, 0.04001])


FULL = f"""\
{NAMES},voltage-right-drive,velocity-right-drive
0.00,1,0,0,quasistatic-forward,5,10
0.02,1,0,0,quasistatic-forward,5,20
0.04,0,0,0,none,0,0
0.06,1,0,0,quasistatic-forward,6,30
0.08,1,0,0,quasistatic-forward,6,40
"""


def test_full_csv_with_two_motors(imported, refused):
    recording = imported(FULL, "log.csv", units="meters", wheel_radius_m=0.1, motor="right")
    assert recording.measured == "speed" and recording.period_s == 0.02
    # The same test twice in a row is two segments.
    assert [part.volts.tolist() for part in recording.segments] == [[5, 5], [6, 6]]
    np.testing.assert_allclose(recording.segments[1].speed_rad_s, [300, 400])
    assert "left-drive, right-drive" in refused(FULL, "log.csv", units="radians")
    assert "choose one" in refused(FULL, "log.csv", units="radians", motor="arm")


@pytest.mark.parametrize(
    "units, factor",
    [("rotations", 2 * np.pi), ("radians", 1), ("degrees", np.pi / 180), ("feet", 3.048), ("inches", 0.254)],
)
def test_csv_units(imported, units, factor):
    recording = imported(FULL, "log.csv", units=units, wheel_radius_m=0.1, motor="right")
    np.testing.assert_allclose(recording.segments[0].speed_rad_s, np.array([10, 20]) * factor)


BAD_CSV = {
    "no units": (SPARSE, {}, "units rotations|"),
    "units": (SPARSE, {"units": "furlongs"}, "'furlongs'"),
    "length": (SPARSE, {"units": "meters"}, "wheel_radius_m"),
    "radius": (SPARSE, {"units": "meters", "wheel_radius_m": -1.0}, "wheel_radius_m"),
    "no state": (SPARSE.replace("sysid-test-state", "state"), {"units": "radians"}, "sysid-test-state"),
    "no time": (SPARSE.replace("Timestamp", "t"), {"units": "radians"}, "Timestamp"),
    "no motor": (SPARSE.replace("voltage-", "current-"), {"units": "radians"}, "voltage-"),
    "state": (SPARSE.replace("dynamic-reverse", "dynamic"), {"units": "radians"}, "line 11: the test 'dynamic'"),
    "no test": (f"{NAMES}\n0,1,2,3,none\n", {"units": "radians"}, "no row"),
    "time": (SPARSE.replace("0.040000", "0.010000"), {"units": "radians"}, "line 7: the time runs backwards"),
    "text": (SPARSE.replace(",7.0,", ",full,"), {"units": "radians"}, "line 11: NT:/voltage-left-drive is 'full'"),
}  # fmt: skip


@pytest.mark.parametrize("bad", BAD_CSV.values(), ids=BAD_CSV)
def test_bad_csv(refused, bad):
    text, flags, reason = bad
    assert reason in refused(text, "log.csv", **flags)


def test_command(tmp_path):
    path, out = tmp_path / "log.csv", tmp_path / "m1.csv"
    path.write_text(SPARSE)
    app = typer.Typer()
    app.command(name="import")(import_command)
    result = CliRunner().invoke(app, [str(path), "-o", str(out), "--from", "sysid", "--units", "rotations"])
    assert result.exit_code == 0, result.output
    assert "4 rows in 2 segments, angle; time stamps are uneven" in result.output
    assert [part.kind for part in read(out).segments] == ["ramp", "step"]
