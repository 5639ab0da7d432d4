"""Arrays make the recording that a log of the same numbers makes."""

import numpy as np
import pytest
from recordings import same

from jaxmotor import JaxmotorError, from_arrays, from_dataframe, import_log, read, write

T = np.arange(400) * 0.005
U = np.repeat(np.tile([0.0, 3.0, -2.0, 1.5], 10), 10)
N = np.floor(np.cumsum(U) * 3).astype(np.int64)


@pytest.fixture
def log(tmp_path):
    (tmp_path / "log.csv").write_text(
        "t,u,n\n" + "".join(f"{t!r},{u},{n}\n" for t, u, n in zip(T.tolist(), U, N, strict=True))
    )
    return import_log(tmp_path / "log.csv", time="t:s", input="u:V", count="n", counts_per_rev=617.4)


def test_arrays_are_read_as_a_log_is(log, tmp_path):
    made = from_arrays(time_s=T, volts=U, counts=N, counts_per_rev=617.4)
    for name in ("time_s", "volts", "tick", "count"):
        assert np.array_equal(getattr(made.segments[0], name), getattr(log.segments[0], name))
    assert (made.period_s, made.segments[0].at_rest, made.measured) == (0.005, True, "count")
    write(made, tmp_path / "made.csv")
    assert same(read(tmp_path / "made.csv"), made)


def test_segments_state_what_they_are():
    half = slice(200), slice(200, 400)
    made = from_arrays(
        time_s=[T[k] for k in half],
        volts=[U[k] for k in half],
        speed_rad_s=[2 * U[k] for k in half],
        kind=["sine", "step"],
        at_rest=False,
        parameters=[{"frequency_Hz": 2.0}, {}],
        name="bench",
    )
    assert [one.kind for one in made.segments] == ["sine", "step"] and made.name == "bench"
    assert [one.start_s for one in made.segments] == pytest.approx([0.0, 1.0])
    assert [one.parameters for one in made.segments] == [{"frequency_Hz": 2.0}, {}]
    assert not any(one.at_rest for one in made.segments)


def test_duties_of_a_supply():
    made = from_arrays(time_s=T, duty=np.rint(50 * U), angle_rad=0.1 * N, duty_full_scale=255, supply_V=7.4)
    assert made.segments[0].volts == pytest.approx(np.rint(50 * U) / 255 * 7.4)
    for number in (np.float32(7.4), np.array(7.4)):
        again = from_arrays(time_s=T, duty=np.rint(50 * U), angle_rad=0.1 * N, duty_full_scale=255, supply_V=number)
        assert again.segments[0].volts == pytest.approx(made.segments[0].volts)
    logged = from_arrays(time_s=T, duty=np.rint(50 * U), angle_rad=0.1 * N, duty_full_scale=255, supply_V=0 * T + 7.4)
    assert logged.segments[0].volts == pytest.approx(made.segments[0].volts) and logged.supply_V == pytest.approx(7.4)


def test_rows_without_a_number_are_gaps():
    counts = np.where(np.arange(400) == 100, np.nan, N)
    made = from_arrays(time_s=T, volts=U, counts=counts, counts_per_rev=617.4)
    tick = made.segments[0].tick
    assert tick is not None and len(tick) == 399 and 100 not in tick


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({}, "exactly one of volts and duty"),
        ({"volts": U}, "exactly one of counts, angle_rad and speed_rad_s"),
        ({"volts": U, "counts": N}, "counts_per_rev"),
        ({"volts": U[:5], "speed_rad_s": U}, "volts has 5 rows, time_s 400"),
        ({"volts": U[:, None], "speed_rad_s": U}, "arrays .n,. of one length"),
        ({"volts": U, "counts": N + 0.5, "counts_per_rev": 6.0}, "not whole"),
        ({"volts": ["a"] * 400, "speed_rad_s": U}, "not numbers"),
        ({"volts": U, "speed_rad_s": np.where(T > 1, np.inf, U)}, "row 202: speed_rad_s is 'inf'"),
        ({"volts": U, "speed_rad_s": U, "time_s": T[::-1]}, "row 2: the time runs backwards"),
        ({"volts": U, "speed_rad_s": U, "kind": "jump"}, "kind = 'jump' is not known"),
        ({"volts": U, "speed_rad_s": U, "kind": ["step", "sine"]}, "kind is a list of 2"),
        ({"duty": U, "speed_rad_s": U}, "duty needs duty_full_scale"),
        ({"duty": U, "speed_rad_s": U, "duty_full_scale": 255}, "supply"),
        ({"volts": U, "counts": N, "counts_per_rev": -1}, "counts_per_rev is -1"),
        ({"volts": U, "counts": N, "time_s": None}, "time_s holds object, not numbers"),
        ({"volts": [], "speed_rad_s": [], "time_s": []}, "give arrays .n,. of one length"),
        ({"volts": U, "speed_rad_s": U, "parameters": {"frequency_Hz": -1.0}}, "frequency_Hz = '-1.0' is no frequency"),
    ],
    ids=range(17),
)
def test_what_cannot_be_is_a_sentence(given, says):
    with pytest.raises(JaxmotorError, match=says):
        from_arrays(**{"time_s": T} | given)


def test_data_frames():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"t": T, "u": U, "n": N, "run": np.arange(400) // 200})
    made = from_dataframe(frame, time_s="t", volts="u", counts="n", counts_per_rev=617.4, segment="run")
    assert len(made.segments) == 2 and made.period_s == 0.005
    assert np.array_equal(made.to_dataframe()["volts"], U)
    frame.index = pandas.to_datetime(T, unit="s")
    assert from_dataframe(frame, volts="u", counts="n", counts_per_rev=617.4).period_s == pytest.approx(0.005)
    with pytest.raises(JaxmotorError, match="there is no column 'U'; the columns are t, u, n, run"):
        from_dataframe(frame, volts="U", counts="n")
    with pytest.raises(JaxmotorError, match="int is no data frame"):
        from_dataframe(5, volts="u")


def test_without_pandas_a_frame_is_a_sentence(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(JaxmotorError, match="pip install pandas"):
        from_arrays(time_s=T, volts=U, speed_rad_s=U).to_dataframe()
