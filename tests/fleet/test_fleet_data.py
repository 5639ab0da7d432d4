"""Data sets: folders, Parquet files cut anywhere, and what can be wrong with them."""

import dataclasses
import json
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fleets import short, with_lost_ticks

import jaxmotor as jm
from jaxmotor.fleet import open_dataset, read_part, write_parquet


def all_of(dataset):
    return [entry for part in dataset.parts for entry in read_part(part)]


def assert_equal(one, other):
    assert len(one.segments) == len(other.segments)
    for a, b in zip(one.segments, other.segments, strict=True):
        assert (a.kind, a.at_rest, dict(a.parameters)) == (b.kind, b.at_rest, dict(b.parameters))
        np.testing.assert_array_equal(a.tick, b.tick)
        np.testing.assert_array_equal(a.count, b.count)
        np.testing.assert_allclose(a.volts, b.volts, rtol=1e-12)


def test_parquet_gives_back_what_was_written(tmp_path):
    rng = np.random.default_rng(1)
    given = {f"unit {k}": short(k) if k % 2 else with_lost_ticks(short(k), rng) for k in range(5)}
    assert write_parquet(given.items(), tmp_path / "fleet.parquet", 2) == 5
    entries = all_of(open_dataset(tmp_path / "fleet.parquet"))
    assert [entry.motor for entry in entries] == list(given)
    for entry in entries:
        assert_equal(entry.recording, given[entry.motor])


def with_supply(recording, mean_V):
    """`recording` with a supply that was logged beside it."""
    noise = np.random.default_rng(3)
    segments = [
        dataclasses.replace(one, supply_V=np.round(mean_V + 0.05 * noise.standard_normal(len(one)), 3))
        for one in recording.segments
    ]
    return dataclasses.replace(recording, segments=tuple(segments))


def test_parquet_keeps_the_supply_that_was_logged(tmp_path):
    given = with_supply(short(1), 7.4)
    write_parquet([("m", given)], tmp_path / "f.parquet")
    [entry] = all_of(open_dataset(tmp_path / "f.parquet"))
    for a, b in zip(entry.recording.segments, given.segments, strict=True):
        np.testing.assert_array_equal(a.supply_V, b.supply_V)
    jm.write(given, tmp_path / "f.csv")
    assert_equal(entry.recording, jm.read(tmp_path / "f.csv"))
    with pytest.raises(jm.JaxmotorError, match="other columns"):
        write_parquet([("m", given), ("n", short(1))], tmp_path / "two.parquet")


@pytest.mark.parametrize("group", [37, 500, 1000, 5000])
@pytest.mark.parametrize("cut", [1, 900])
def test_a_motor_may_go_on_in_the_next_row_group(tmp_path, monkeypatch, group, cut):
    given = {f"m{k}": short(k) for k in range(4)}
    write_parquet(given.items(), tmp_path / "whole.parquet")
    table = pq.read_table(tmp_path / "whole.parquet")
    pq.write_table(table, tmp_path / "cut.parquet", row_group_size=group)
    monkeypatch.setattr("jaxmotor.fleet._parquet.ROWS_PER_CUT", cut)
    dataset = open_dataset(tmp_path / "cut.parquet")
    assert len(dataset.parts) == max(-(-len(table) // max(group * -(-cut // group), 1)), 1)
    entries = all_of(dataset)
    assert [entry.motor for entry in entries] == list(given)
    for entry in entries:
        assert_equal(entry.recording, given[entry.motor])


def test_motors_need_not_have_all_segments(tmp_path):
    write_parquet([("a", short(0)), ("b", short(1))], tmp_path / "f.parquet")
    table = pq.read_table(tmp_path / "f.parquet")
    kept = table.filter((pa.compute.field("motor") == "a") | (pa.compute.field("segment") != 1))
    pq.write_table(kept, tmp_path / "f.parquet")
    whole, part = all_of(open_dataset(tmp_path / "f.parquet"))
    assert len(whole.recording.segments) == 5 and len(part.recording.segments) == 4
    assert part.recording.segments[1].parameters["frequency_Hz"] == 7.7


def damaged(tmp_path, **columns):
    """One motor of three whose columns are changed at one row."""
    write_parquet([(f"m{k}", short(k)) for k in range(3)], tmp_path / "f.parquet")
    table = pq.read_table(tmp_path / "f.parquet")
    row = len(table) // 3 + 7
    for name, value in columns.items():
        values = table.column(name).to_pylist()
        values[row] = value
        table = table.set_column(table.schema.get_field_index(name), name, pa.array(values))
    pq.write_table(table, tmp_path / "f.parquet")
    return all_of(open_dataset(tmp_path / "f.parquet"))


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        ({"count": None}, "row 8: count is nan"),
        ({"tick": 3}, "row 8: tick 3 runs backwards, from 6 to 3"),
        ({"segment": 9}, "row 8: segment 9 is not in the header"),
        ({"segment": -1}, "row 8: segment -1 is not in the header"),
        ({"volts": float("inf")}, "row 8: volts is inf"),
    ],
)
def test_one_motors_bad_data_are_its_sentence(tmp_path, columns, sentence):
    first, bad, last = damaged(tmp_path, **columns)
    assert first.recording is not None and last.recording is not None
    assert bad.recording is None and sentence in bad.problem and "motor m1" in bad.problem


def test_wrong_files_are_sentences(tmp_path):
    jm.write(short(0), tmp_path / "good.csv")
    (tmp_path / "torn.parquet").write_bytes(b"PAR1 and no more")
    pq.write_table(pa.table({"segment": [0], "tick": [0]}), tmp_path / "nameless.parquet")
    pq.write_table(pa.table({"motor": pa.array([], pa.string())}), tmp_path / "none.parquet")
    (tmp_path / "_SUCCESS.csv").write_text("")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "lost.csv").symlink_to(tmp_path / "nothing")
    os.mkfifo(tmp_path / "pipe.csv")
    skipped = [name.removeprefix(f"{tmp_path}/") for name in open_dataset(tmp_path).skipped]
    assert skipped == ["folder.csv (a folder)", "lost.csv (a link to nothing)", "pipe.csv (not a plain file)"]
    entries = {entry.motor: entry for entry in all_of(open_dataset(tmp_path))}
    assert set(entries) == {"good", "torn", "nameless", "none"}
    assert entries["good"].recording is not None
    assert "cannot be read as Parquet" in entries["torn"].problem
    assert "column 'motor' is missing" in entries["nameless"].problem
    assert "there are no rows" in entries["none"].problem


def test_metadata_are_checked_like_a_header(tmp_path):
    write_parquet([("a", short(0))], tmp_path / "f.parquet")
    table = pq.read_table(tmp_path / "f.parquet")
    for change, sentence in (
        ({"period_s": "-1"}, "period_s = -1 is out of range"),
        ({"counts_per_rev": None}, "needs the header key counts_per_rev"),
        ({"segment": json.dumps([{"kind": "wiggle"}])}, "kind = 'wiggle' is not known"),
        ({"segment": "not JSON"}, "'segment' is a list of tables"),
    ):
        metadata = {key.decode(): value for key, value in table.schema.metadata.items()} | change
        metadata = {key: value for key, value in metadata.items() if value is not None}
        pq.write_table(table.replace_schema_metadata(metadata), tmp_path / "f.parquet")
        [entry] = all_of(open_dataset(tmp_path / "f.parquet"))
        assert sentence in entry.problem


def test_nothing_to_read_is_one_sentence(tmp_path):
    with pytest.raises(jm.JaxmotorError, match="no recordings"):
        open_dataset(tmp_path)
    with pytest.raises(jm.JaxmotorError, match="no such file or folder"):
        open_dataset(tmp_path / "not there")


def test_a_shared_file_needs_a_shared_header(tmp_path):
    with pytest.raises(jm.JaxmotorError, match="another header"):
        write_parquet([("a", short(0)), ("b", jm.Recording(short(1).segments[:2], "x"))], tmp_path / "f.parquet")
    assert not (tmp_path / "f.parquet").exists() and not list(tmp_path.iterdir())
