"""Logs that do not state how their speeds were averaged, validated as the model's own log shows it."""

import dataclasses
import json

import numpy as np
import pytest
from speed_logs import SpeedLog, speed_log

from jaxmotor import JaxmotorError, Model, Recording, identify, read_model
from jaxmotor.estimate import to_json
from jaxmotor.validation import validate

SEEDS = {"window": 7, "filter": 6, "uneven": 6}


def in_two(log: SpeedLog) -> Recording:
    """The log without what its header states of the window; its last rows are a segment that begins in motion."""
    segment, cut = log.unstated.segments[0], 1200

    def part(rows: slice) -> dict[str, np.ndarray]:
        names = ("time_s", "volts", "tick", "speed_rad_s")
        return {name: getattr(segment, name)[rows] for name in names if getattr(segment, name) is not None}

    first = dataclasses.replace(segment, **part(slice(cut)))
    return dataclasses.replace(
        log.unstated, segments=(first, dataclasses.replace(segment, at_rest=False, **part(slice(cut, None))))
    )


def rmse(model: Model, recording: Recording) -> float:
    found = validate(model, recording, simulations=64).open_loop
    assert found is not None
    return found.pooled.rmse_rad_s


@pytest.fixture(scope="module", params=["window", "filter", "uneven"])
def identified(request):
    log = speed_log(np.random.default_rng(SEEDS[request.param]), request.param)
    recording = in_two(log)
    return log, recording, identify(recording, hold_out=[1])


def test_validation_reads_speeds_as_the_identification_did(identified, tmp_path):
    log, recording, fit = identified
    assert fit.average is not None and fit.average.kind == ("filter" if log.seen == "filter" else "window")
    path = tmp_path / "model.json"
    path.write_text(json.dumps(to_json(fit)))
    model = read_model(path)
    assert model.average == fit.average
    assert rmse(model, recording) < 1.1 * log.noise
    assert rmse(dataclasses.replace(model, average=None), recording) > 1.5 * log.noise
    [note] = [one for one in validate(model, recording, simulations=64).notes if "recording that the model" in one]
    assert fit.average.sentence in note


def test_a_header_that_states_the_window_is_believed(identified):
    log, recording, fit = identified
    stated = dataclasses.replace(recording, speed_window_s=log.recording.speed_window_s)
    notes = validate(fit, stated, simulations=64).notes
    assert not any("recording that the model" in note for note in notes)


def test_a_log_that_is_not_averaged_is_read_as_it_is(identified):
    """The model's average is none of a log that it does not bring nearer to the model."""
    _, _, fit = identified
    plain = speed_log(np.random.default_rng(9), "instantaneous")
    model = dataclasses.replace(fit.model, motor=identify(plain.recording).motor, offset_V=0.0)
    assert rmse(model, plain.unstated) < 1.1 * plain.noise


def test_segments_shorter_than_the_window_are_read_as_they_are(identified):
    log, recording, fit = identified
    _, last = recording.segments
    names = [name for name in ("time_s", "volts", "tick", "speed_rad_s") if getattr(last, name) is not None]
    some = {name: getattr(last, name)[:4] for name in names}
    short = dataclasses.replace(recording, segments=(last, dataclasses.replace(last, **some)))
    notes = validate(fit, short, simulations=64).notes
    assert any("recording that the model" in note for note in notes) == (log.seen == "filter")


@pytest.mark.parametrize(
    "average",
    [
        [],
        {},
        {"kind": "mean"},
        {"kind": "window", "length_s": -1.0},
        {"kind": "window", "length_s": True},
        {"kind": "window", "length_s": 0.02, "rows": 2.5},
        {"kind": "window", "length_s": 0.02, "rows": 10**9},
        {"kind": "filter", "length_s": 0.02, "standard_error_s": "small"},
        {"kind": "window", "length_s": 0.02, "separable": 1},
    ],
)
def test_no_speeds_are_averaged_so(identified, tmp_path, average):
    path = tmp_path / "model.json"
    path.write_text(json.dumps(to_json(identified[2]) | {"speed_average": average}))
    with pytest.raises(JaxmotorError, match=r"model\.json: speed_average"):
        read_model(path)
