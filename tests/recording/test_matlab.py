"""Files of MATLAB: as SciPy writes them, as scripts and Simulink lay them out, torn and damaged."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from jaxmotor import JaxmotorError
from jaxmotor.recording import _matlab as matlab
from jaxmotor.recording import import_log, import_steady
from jaxmotor.recording._matlab import read_matlab

ROWS = 200
TIME = np.arange(ROWS) * 0.005
VOLTS = np.where(np.arange(ROWS) < 20, 0.0, 3.0)
SPEED = 12.0 * (1 - np.exp(-20 * np.maximum(TIME - 0.1, 0)))
STATED = {"time": "t", "input": "u:V", "speed": "w:rad/s"}


def saved(tmp_path, content, name="log.mat", **options):
    path = tmp_path / name
    savemat(path, content, **options)
    return path


def is_the_log(recording):
    [run] = recording.segments
    return np.allclose(run.time_s, TIME) and np.array_equal(run.volts, VOLTS) and np.array_equal(run.speed_rad_s, SPEED)


@pytest.mark.parametrize("format", ["4", "5"])
@pytest.mark.parametrize("as_rows", [True, False])
def test_vectors(tmp_path, format, as_rows):
    content = {"t": TIME, "u": VOLTS, "w": SPEED, "gain": 3.0, "note": "a step"}
    path = saved(tmp_path, content, format=format, oned_as="row" if as_rows else "column")
    assert is_the_log(import_log(path, **STATED))


def test_compressed_and_whole_numbers(tmp_path):
    content = {"t": TIME, "u": VOLTS.astype(np.int16), "w": SPEED, "on": VOLTS > 0}
    path = saved(tmp_path, content, "LOG.MAT", do_compression=True)
    assert is_the_log(import_log(path, **STATED))
    assert set(read_matlab(path).cells["on"]) == {"0", "1"}


def test_a_structure_of_vectors(tmp_path):
    assert is_the_log(import_log(saved(tmp_path, {"raw": {"t": TIME, "u": VOLTS, "w": SPEED}}), **STATED))


def test_fields_of_one_name_are_called_by_their_structures(tmp_path):
    left, right = ({"w": SPEED, "at": TIME}, {"w": -SPEED, "at": TIME})
    path = saved(tmp_path, {"t": TIME, "u": VOLTS, "left": left, "right": right})
    assert set(read_matlab(path).cells) == {"t", "u", "left.w", "right.w", "left.at", "right.at"}
    assert is_the_log(import_log(path, **STATED | {"speed": "left.w:rad/s"}))
    with pytest.raises(JaxmotorError, match="there is no column 'w'"):
        import_log(path, **STATED)


def test_simulink_to_file_and_structure_with_time(tmp_path):
    to_file = saved(tmp_path, {"ans": np.stack([TIME, VOLTS, SPEED])})
    assert is_the_log(import_log(to_file, time="ans(1)", input="ans(2):V", speed="ans(3):rad/s"))
    signals = np.array([({"values": VOLTS[:, None]},), ({"values": SPEED[:, None]},)], dtype=object)
    scope = {"time": TIME[:, None], "signals": np.array([one for (one,) in signals], dtype=object)}
    path = saved(tmp_path, {"scope": scope})
    stated = {"time": "time", "input": "scope.signals(1).values:V", "speed": "scope.signals(2).values:rad/s"}
    assert is_the_log(import_log(path, **stated))


def test_vectors_of_other_lengths_are_no_columns(tmp_path):
    path = saved(tmp_path, {"t": TIME, "u": VOLTS, "w": SPEED, "plan": np.arange(7.0)})
    assert set(read_matlab(path).cells) == {"t", "u", "w"}


def test_columns_that_are_named_may_be_shorter_than_most(tmp_path):
    others = {name: np.arange(90.0) for name in ("t1", "u1", "w1", "t2")}
    path = saved(tmp_path, {"t": TIME, "u": VOLTS, "w": SPEED, **others})
    assert is_the_log(import_log(path, **STATED))
    run = {"t": TIME, "u": VOLTS, "w": SPEED}
    path = saved(tmp_path, {"a": run, "b": {name: np.arange(90.0) for name in "tuwxyz"}})
    assert is_the_log(import_log(path, time="a.t", input="a.u:V", speed="a.w:rad/s"))
    with pytest.raises(JaxmotorError, match=rf"of the columns a.u has {len(TIME)}, b.w has 90 rows; save vectors"):
        import_log(path, time="a.t", input="a.u:V", speed="b.w:rad/s")


def test_rows_without_a_reading_keep_their_input_and_first_ones_are_left_out(tmp_path):
    holes = SPEED.copy()
    holes[50:60] = np.nan
    path = saved(tmp_path, {"t": TIME, "u": VOLTS, "w": holes})
    [run] = import_log(path, **STATED, drop_first=5).segments
    assert len(run) == ROWS - 5 and run.tick is not None and run.tick[-1] == ROWS - 6
    assert np.flatnonzero(~run.read).tolist() == list(range(45, 55))
    early = TIME.copy()
    early[30] = early[28]
    with pytest.raises(JaxmotorError, match=r"log.mat, row 31: "):
        import_log(saved(tmp_path, {"t": early, "u": VOLTS, "w": SPEED}), **STATED)


def test_steady_states(tmp_path):
    volts = np.linspace(-5, 5, 11)
    path = saved(tmp_path, {"u": volts, "y": 3 * volts})
    stated = {"speed": "y:rad/s", "hold_s": 1.0, "period_s": 0.02}
    assert len(import_steady(path, input="u:V", **stated).segments) == 11
    of_unknown = import_steady(path, input="u:duty:5", supply_unknown=True, **stated)
    assert of_unknown.segments[-1].volts[0] == 1.0 and of_unknown.header["supply_unknown"] is True
    with pytest.raises(JaxmotorError, match="leave supply_unknown out"):
        import_steady(path, input="u:duty:5", supply_V=6.0, supply_unknown=True, **stated)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"x": 3.0, "name": "motor"}, "no vector of numbers"),
        ({"x": np.array([1 + 2j, 3.0])}, "no vector of numbers"),
        ({"x": np.arange(3.0), "y": np.arange(3.0)}, "none is left"),
    ],
)
def test_what_is_no_log(tmp_path, content, said):
    with pytest.raises(JaxmotorError, match=said):
        read_matlab(saved(tmp_path, content), drop=3)


def test_what_is_no_such_file(tmp_path):
    path = tmp_path / "log.mat"
    for data, said in ((b"MATLAB 7.3 MAT-file" + bytes(600), "7.3"), (b"t,u,w\n0,1,2\n" * 50, "no file of MATLAB")):
        path.write_bytes(data)
        with pytest.raises(JaxmotorError, match=said):
            read_matlab(path)
    with pytest.raises(JaxmotorError, match="leave columns"):
        import_log(saved(tmp_path, {"t": TIME}), **STATED, columns="t,u,w")


def test_a_small_file_that_expands_without_end_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(matlab, "MAX_BYTES", 2**20)
    path = saved(tmp_path, {"t": TIME, "u": VOLTS, "w": SPEED})
    assert is_the_log(import_log(path, **STATED))
    bomb = zlib.compress(bytes(2**24))
    path.write_bytes(path.read_bytes()[: matlab.HEADER] + struct.pack("<II", matlab.COMPRESSED, len(bomb)) + bomb)
    with pytest.raises(JaxmotorError, match="more than 1048576 bytes"):
        read_matlab(path)


def file_of(do_compression):
    made = io.BytesIO()
    savemat(made, {"t": TIME[:40], "raw": {"u": VOLTS[:40], "w": SPEED[:40]}}, do_compression=do_compression)
    return made.getvalue()


FILES = [file_of(True), file_of(False)]


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(FILES),
    st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), max_size=4),
    st.integers(0, 10**6),
)
def test_damage_is_one_sentence(tmp_path_factory, data, changes, length):
    damaged = bytearray(data)
    for place, value in changes:
        damaged[place % len(data)] = value
    path = tmp_path_factory.getbasetemp() / "damaged.mat"
    path.write_bytes(bytes(damaged[: length % len(data) + 1] if length % 3 == 0 else damaged))
    try:
        table = read_matlab(path)
    except JaxmotorError as error:
        assert "\n" not in str(error) and str(error).startswith(str(path))
    else:
        assert len({len(column) for column in table.cells.values()}) == 1
