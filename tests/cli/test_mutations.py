"""Damaged plans, plants and models through the command line: run, or refused in one short sentence."""

import os

import mutations
import pytest
from _mutate import HOW

PATIENCE_S = 120.0
"""However slow this machine is now."""


def faults(outcome):
    """What should not be; how long it took is for the benchmark."""
    return set(outcome.faults()) - {"slow"}


@pytest.mark.parametrize("kind", list(mutations.WRITERS))
def test_damaged_files(kind, tmp_path, monkeypatch, request):
    """Ten of each damage."""
    if kind != "model":
        request.getfixturevalue("emulator")
    monkeypatch.setenv("JAXMOTOR_CACHE", "")
    found = mutations.run(10 * len(HOW), 7, tmp_path, [kind], subprocesses=0, limit_s=PATIENCE_S)
    wrong = [
        (case.number, faults(case.outcome), case.outcome.err[-300:])
        for cases in found.values()
        for case in cases
        if faults(case.outcome)
    ]
    assert wrong == []
    refused = [case for cases in found.values() for case in cases if case.outcome.code == 1]
    assert len(refused) > 30


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '[[experiment]]\nkind = "sine"\nfrequency_Hz = [' + "1," * 5000 + "]\namplitude_V = 1\nrepeat = 10000",
            "50000000 exp",
        ),
        ("x = " + "[" * 100_000, "nested deeper"),
        ("a." * 100_000 + "b = 1", "nested deeper"),
        ("x" * 3000 + " = 1", "is not known here"),
        ('"\\u001b[31m" = 1', "\\x1b[31m is not known here"),
        ("rest_s = 1e300", "rest_s = 1e+300 is more than"),
        ("rest_s = 1e-300", "rest_s = 1e-300 is more than"),
        ("rest_s = 0x" + "f" * 5000, "beyond 64 bits"),
        ("rest_s = nan", "rest_s = nan is not a number"),
        ("detune = 1", "detune = 1 is not true or false"),
        ("name = " + '"' + "x" * 3000 + '"', "name has 3000 characters"),
        ("supply_V = [[[1]]]", "supply_V = a list of 1 is not a number"),
        ("notes = 1979-05-27", "notes is text"),
        ("", "has no experiments"),
        ("\0", "binary data"),
    ],
)
def test_plans_of_strangers(text, said, tmp_path):
    (tmp_path / "p.toml").write_text(text + "\n")
    outcome = mutations.in_process(
        ["record", "--port", "nowhere", "--plan", str(tmp_path / "p.toml"), "-o", "x.csv"], PATIENCE_S
    )
    assert outcome.code == 1 and faults(outcome) == set() and said in outcome.said


@pytest.mark.parametrize("make", ["mkdir", "link", "pipe", "large", "bytes", "device"])
@pytest.mark.parametrize("kind", ["plan", "model", "recording"])
def test_files_that_are_none(kind, make, tmp_path):
    path = tmp_path / "file"
    if make == "mkdir":
        path.mkdir()
    elif make == "link":
        path.symlink_to(tmp_path / "nothing")
    elif make == "pipe":
        os.mkfifo(path)
    elif make == "large":
        with path.open("wb") as file:
            file.truncate(1_000_000_000)
    elif make == "bytes":
        path.write_bytes(b"\xff\xfe\x00\x01" * 20)
    else:
        path.symlink_to("/dev/zero")
    command = {
        "plan": ["record", "--port", "nowhere", "-o", "x.csv", "--plan", str(path)],
        "model": ["export", str(path), "--to", "json"],
        "recording": ["identify", str(path)],
    }[kind]
    outcome = mutations.in_process(command, PATIENCE_S)
    assert outcome.code == 1 and faults(outcome) == set()
