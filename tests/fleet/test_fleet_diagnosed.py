"""Motors of a fleet that are diagnosed, too: named causes, sentences, runs that were stopped, and Dask."""

import json

import numpy as np
import pytest
from fleets import SHORT, recording, short
from test_fleet_run import table

import jaxmotor as jm
from jaxmotor.cli import main
from jaxmotor.diagnosis import diagnose
from jaxmotor.fleet import Options, identify_fleet, read_results

FRICTION_V = 0.4


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    """A linear motor, one with friction, one that stands still, and no recording, in parts of two."""
    monkeypatch.setattr("jaxmotor.fleet._run.DIAGNOSED_PER_PART", 2)
    folder = tmp_path / "fleet"
    folder.mkdir()
    jm.write(short(1), folder / "a_linear.csv")
    jm.write(recording(2, friction=FRICTION_V, runs=SHORT), folder / "b_friction.csv")
    jm.write(short(3, gain=1e-9), folder / "c_still.csv")
    (folder / "d_none.csv").write_text("hello\n")
    return folder


@pytest.mark.filterwarnings("ignore")  # Dask's own, about its own threads and sockets
def test_each_motor_is_diagnosed_or_has_its_sentence(dataset, tmp_path, capsys):
    class Stop(Exception):
        pass

    def stop(done):
        raise Stop

    output, options = tmp_path / "r.parquet", Options(diagnose=True)
    with pytest.raises(Stop):
        identify_fleet(dataset, output, options=options, workers=1, progress=stop)
    assert [path.name for path in (tmp_path / "r.parquet.parts").glob("*.parquet")] == ["part-000000.parquet"]
    assert main(["fleet", str(dataset), "-o", str(output), "--diagnose", "--workers", "1"]) == 1
    linear, rubbing, still, none = table(output)

    alone = diagnose(jm.read(dataset / "b_friction.csv"))
    named = [one.name for one in alone.effects]
    assert (linear["verdict"], linear["effects"], linear["diagnosis_problem"]) == ("complete", [], None)
    assert named and (rubbing["verdict"], rubbing["effects"]) == (alone.verdict, named)
    parameters = json.loads(rubbing["effect_parameters"])
    assert parameters == {one.name: one.parameters for one in alone.effects}
    assert parameters[named[0]]["volts_V"] == pytest.approx(FRICTION_V, rel=0.05)
    assert (
        json.loads(rubbing["effect_standard_errors"])[named[0]]["volts_V"] == alone.effects[0].standard_error["volts_V"]
    )
    assert rubbing["diagnosed_gain_rad_s_V"] == float(alone.motor.linear.gain)
    assert rubbing["diagnosed_pole_rad_s"] == pytest.approx(40.0, rel=0.05)
    assert rubbing["held_out_chi2_after"] < 1.3 < rubbing["held_out_chi2_before"]
    for row in (still, none):
        assert row["verdict"] is row["effects"] is row["effect_parameters"] is row["held_out_chi2_after"] is None
        assert row["diagnosis_problem"] and row["problem"]
    assert none["diagnosis_problem"] == none["problem"]

    said = capsys.readouterr().out
    assert "1 complete: no effect" in said and f"1 {alone.verdict}: {' + '.join(named)}" in said
    assert "2 of them could not be diagnosed: column 'diagnosis_problem' says why" in said
    results = read_results(output)
    assert list(results["verdict"]) == ["complete", alone.verdict]
    assert np.isfinite(results["held_out_chi2_after"]).all()

    identify_fleet(dataset, tmp_path / "dask.parquet", options=options, cluster="local", workers=1)
    assert table(tmp_path / "dask.parquet") == table(output)


def test_without_the_option_nothing_is_diagnosed(dataset, tmp_path):
    identify_fleet(dataset, tmp_path / "r.parquet", workers=1)
    assert {row["verdict"] for row in table(tmp_path / "r.parquet")} == {None}
    with pytest.raises(jm.JaxmotorError, match="with these options"):
        identify_fleet(dataset, tmp_path / "r.parquet", options=Options(diagnose=True))
