"""Whole runs: what is there afterwards, whatever came between."""

import json
import re
import threading

import pyarrow.parquet as pq
import pytest
from fleets import short

import jaxmotor as jm
from jaxmotor.cli import main
from jaxmotor.fleet import identify_fleet, read_results, write_parquet


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    """Seven motors in parts of two."""
    monkeypatch.setattr("jaxmotor.fleet._dataset.FILES_PER_PART", 2)
    folder = tmp_path / "fleet"
    folder.mkdir()
    for seed in range(7):
        jm.write(short(seed, gain=9.0 + seed), folder / f"m{seed}.csv")
    return folder


def table(path):
    return pq.read_table(path).to_pylist()


def test_one_row_each_in_order(dataset, tmp_path):
    received = []
    summary = identify_fleet(dataset, tmp_path / "r.parquet", progress=received.append)
    rows = table(tmp_path / "r.parquet")
    assert [row["motor"] for row in rows] == [f"m{k}" for k in range(7)]
    assert (summary.motors, summary.problems, summary.doubled) == (7, 0, 0)
    assert sum(done.motors for done in received) == 7 and {done.parts for done in received} == {4}
    for k, row in enumerate(rows):
        assert row["gain_rad_s_V"] == pytest.approx(9.0 + k, abs=5 * row["gain_standard_error_rad_s_V"])
    assert not (tmp_path / "r.parquet.parts").exists()
    assert list(read_results(tmp_path / "r.parquet")["motor"]) == [f"m{k}" for k in range(7)]


def test_goes_on_where_it_was_stopped(dataset, tmp_path):
    class Stop(Exception):
        pass

    def stop(done):
        if done.part == 1:
            raise Stop

    with pytest.raises(Stop):
        identify_fleet(dataset, tmp_path / "r.parquet", workers=1, progress=stop)
    kept = sorted(path.name for path in (tmp_path / "r.parquet.parts").glob("*.parquet"))
    assert kept == ["part-000000.parquet", "part-000001.parquet"] and not (tmp_path / "r.parquet").exists()
    received = []
    identify_fleet(dataset, tmp_path / "r.parquet", workers=1, progress=received.append)
    assert [done.before for done in received] == [True, True, False, False]
    identify_fleet(dataset, tmp_path / "whole.parquet", workers=2)
    assert table(tmp_path / "r.parquet") == table(tmp_path / "whole.parquet")
    received.clear()
    assert identify_fleet(dataset, tmp_path / "r.parquet", progress=received.append).motors == 7 and not received


def test_a_part_that_was_torn_is_done_again(dataset, tmp_path):
    def spoil(done):
        if done.part == 1:
            (tmp_path / "r.parquet.parts" / "part-000000.parquet").write_bytes(b"PAR1")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identify_fleet(dataset, tmp_path / "r.parquet", workers=1, progress=spoil)
    assert identify_fleet(dataset, tmp_path / "r.parquet", workers=1).motors == 7


def test_what_is_in_the_way_is_a_sentence(dataset, tmp_path):
    (tmp_path / "r.parquet").write_text("my thesis")
    with pytest.raises(jm.JaxmotorError, match="is there already"):
        identify_fleet(dataset, tmp_path / "r.parquet")
    assert (tmp_path / "r.parquet").read_text() == "my thesis"
    (tmp_path / "folder").mkdir()
    with pytest.raises(jm.JaxmotorError, match="is a folder"):
        identify_fleet(dataset, tmp_path / "folder")
    with pytest.raises(jm.JaxmotorError, match="cannot be made"):
        identify_fleet(dataset, tmp_path / "no" / "such" / "r.parquet")
    parts = tmp_path / "other.parquet.parts"
    parts.mkdir()
    (parts / "plan.json").write_text(json.dumps({"format": 1}))
    with pytest.raises(jm.JaxmotorError, match="unfinished results of another data set"):
        identify_fleet(dataset, tmp_path / "other.parquet")


def test_two_of_one_name_are_both_done_and_told_apart(tmp_path):
    folder = tmp_path / "fleet"
    folder.mkdir()
    write_parquet([("twin", short(1)), ("single", short(2))], folder / "a.parquet")
    write_parquet([("twin", short(3))], folder / "b.parquet")
    summary = identify_fleet(folder, tmp_path / "r.parquet")
    assert (summary.motors, summary.doubled) == (3, 1)
    noted = [any("has this name" in note for note in row["notes"]) for row in table(tmp_path / "r.parquet")]
    assert noted == [True, False, True]


def test_threads_do_not_change_a_callers_precision(dataset, tmp_path):
    import jax

    identify_fleet(dataset, tmp_path / "r.parquet", workers=2)
    assert not jax.config.jax_enable_x64
    assert threading.active_count() < 20


def test_the_command(dataset, tmp_path, capsys):
    output = tmp_path / "r.parquet"
    assert main(["fleet", str(dataset), "-o", str(output)]) == 0
    said = capsys.readouterr()
    assert "7 motors" in said.out
    # Off the terminal: a line where it takes long, and no empty one.
    assert all(re.fullmatch(r"\d+ s: \d+ motors, .*", line) for line in said.err.splitlines())
    (dataset / "bad.csv").write_text("hello\n")
    assert main(["fleet", str(dataset), "-o", str(output)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert main(["fleet", str(dataset), "-o", str(tmp_path / "s.parquet"), "--workers", "1"]) == 1
    assert "1 of them could not be identified" in capsys.readouterr().out
    assert main(["fleet", str(tmp_path / "none"), "-o", str(output)]) == 1
    error = capsys.readouterr().err
    assert "no such file or folder" in error and error.count("\n") == 1


def test_without_the_extra_one_sentence(dataset, tmp_path, capsys, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert main(["fleet", str(dataset), "-o", str(tmp_path / "r.parquet")]) == 1
    assert "pip install 'jaxmotor[fleet]'" in capsys.readouterr().err
