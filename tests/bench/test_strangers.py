"""Ports that are not there, and others than the board behind them: each a sentence."""

import errno
import os
import time

import pytest
import serial
from boards import Stranger

from jaxmotor.bench import Patience, Port, RecorderError
from jaxmotor.bench._emulator import find_or_build
from jaxmotor.bench._port import _why_not
from jaxmotor.bench._protocol import checksum
from jaxmotor.bench._session import Session


def seal(text: str) -> bytes:
    return text.encode() + b"*" + checksum(text.encode()) + b"\n"


@pytest.mark.parametrize(
    ("greeting", "answer", "said"),
    [
        (b"", b"", "nothing comes from the board"),
        (b"\r\nGrbl 1.1h ['$' for help]\r\n", b"error:1\r\n", "another program answers (\"Grbl 1.1h ['$' for help]\")"),
        (bytes(range(128, 256)) * 2, b"\xf8\x00\x80", "only noise comes"),
        (seal("H 0 0 1/4 protocol=2 firmware=2.0.0"), b"", "the board sends but does not receive"),
    ],
)
def test_who_else_may_be_there(greeting, answer, said):
    patience = Patience(hello_s=0.4)
    with (
        Stranger(greeting, answer) as other,
        Port(other.url, patience=patience) as port,
        pytest.raises(RecorderError) as caught,
    ):
        Session(port)
    assert said in str(caught.value) and other.url in str(caught.value)


def test_another_protocol():
    answer = seal("H 1 1 1/1 protocol=1 firmware=1.0.0")
    with Stranger(answer) as other, Port(other.url) as port, pytest.raises(RecorderError, match="protocol 1"):
        Session(port)


def test_no_such_port():
    with pytest.raises(RecorderError, match="there is no such port"):
        Port("/dev/ttyNOTHING")


def test_nobody_listens():
    with pytest.raises(RecorderError, match="nothing answers there"):
        Port("socket://127.0.0.1:1")


@pytest.mark.parametrize(
    ("number", "said"), [(errno.EACCES, "dialout"), (errno.EBUSY, "in use"), (errno.ENOENT, "no such port")]
)
def test_the_systems_reasons_have_remedies(number, said):
    assert said in _why_not("/dev/ttyUSB0", serial.SerialException(number, "could not open port"))


def test_a_port_in_use():
    leader, follower = os.openpty()
    try:
        name = os.ttyname(follower)
        with Port(name), pytest.raises(RecorderError, match="in use"):
            Port(name)
    finally:
        os.close(leader)
        os.close(follower)


def test_without_sources_or_toolchain(monkeypatch, tmp_path):
    with pytest.raises(RecorderError, match="pip install -e"):
        find_or_build(tmp_path)
    (tmp_path / "Makefile").write_text("")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        RecorderError, match="apt install gcc-avr avr-libc binutils-avr libsimavr-dev libelf-dev gcc make"
    ):
        find_or_build(tmp_path)


def test_a_plant_file_that_does_not_fit(emulator, tmp_path):
    (tmp_path / "p.toml").write_text("[motr]\nx = 1\n")
    with pytest.raises(RecorderError, match="did not start"):
        Port("emulated", plant=tmp_path / "p.toml")


def test_the_wrong_rate(emulator):
    """The emulator garbles what it is told at the wrong rate from 100 ms after its start on."""
    patience = Patience(hello_s=20.0, again_s=0.02, silent_s=0.1)
    options = ("--mode", "fast")
    with Port("emulated", 9600, options=options, patience=patience) as port, Session(port) as session:
        time.sleep(0.1)
        with pytest.raises(RecorderError, match="--baud"):
            session.command("C")
