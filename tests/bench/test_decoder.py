"""The decoder: whatever happens to the bytes, what it accepts is what was sent."""

import random

from faults import damage
from hypothesis import given
from hypothesis import strategies as st

from jaxmotor.bench._protocol import (
    KEEPALIVE,
    Answer,
    Begin,
    Decoder,
    End,
    Hello,
    Ran,
    RunEnd,
    Sample,
    Status,
    checksum,
    encode,
    parse,
)


def seal(text: str) -> bytes:
    return text.encode() + b"*" + checksum(text.encode()) + b"\n"


def a_run(segments=((0, "rest", 20), (1, "step", 60)), sequence=9) -> bytes:
    """What a board says of a run: every line once, numbered."""
    texts, start, count = [], 0, 0
    for segment, kind, ticks in segments:
        texts.append(f"B # 7 {segment} {segment // 2} {kind} {start} {ticks}")
        for tick in range(ticks):
            count += 3 * (kind != "rest")
            supply = " 7380" if tick % 20 == 19 else ""
            texts.append(f"D # {segment} {tick} {150 * (kind != 'rest')} {count}{supply}")
        texts.append(f"E # 7 {segment} done {ticks} {count} 0 0")
        start += ticks
    texts.append(f"Z # 7 done {start} 0 0")
    return b"".join(seal(text.replace("#", str((sequence + k) % 65536))) for k, text in enumerate(texts))


def samples(messages):
    return {(m.segment, m.tick): (m.duty, m.count) for m in messages if isinstance(m, Sample)}


LOG = a_run()
SENT = samples(Decoder().feed(LOG))


def test_every_type_of_line_is_understood():
    lines = b"".join(
        map(
            seal,
            (
                "H 4 1 1/4 protocol=2 firmware=2.0.0 clock_Hz=16000000",
                "A 5 4",
                "N 6 5 argument",
                "B 7 4294967295 1 0 step 20 100",
                "D 8 1 0 -170 -370",
                "D 9 1 1 170 370 7380",
                "E 10 4294967295 1 done 2 20 0 0",
                "Z 11 4294967295 done 22 0 0",
                "Q 12 7 4294967295 host_silent 22 2 2634 0 7380 0 0",
                "R 13 8 4294967295 0 20 2 0 0",
            ),
        )
    )
    messages = Decoder().feed(lines)
    assert [type(m) for m in messages] == [Hello, Answer, Answer, Begin, Sample, Sample, End, RunEnd, Status, Ran]
    assert messages[4].count == -370 and messages[4].supply_mV is None and messages[5].supply_mV == 7380
    assert messages[2].refusal == "argument" and not messages[1].refusal
    assert messages[8].state == "host_silent" and messages[9].ticks == ((20, 2), (0, 0))


def test_commands_are_as_the_protocol_says():
    assert encode("H", 1) == b"H 1*5804\n"
    assert encode("S", 5, 0, "sine", 100, 400, 107588931, 21760, 0) == b"S 5 0 sine 100 400 107588931 21760 0*FFA5\n"
    assert b"K*" + checksum(b"K") + b"\n" == KEEPALIVE


@given(st.lists(st.integers(1, 60), max_size=60))
def test_torn_anywhere_nothing_is_lost(lengths):
    decoder, at, messages = Decoder(), 0, []
    for length in (*lengths, len(LOG)):
        messages += decoder.feed(LOG[at : at + length])
        at += length
    assert samples(messages) == SENT
    assert (decoder.damaged, decoder.missing, decoder.repeated) == (0, 0, 0)


@given(st.integers(0, 2**32), st.integers(1, 60))
def test_damage_never_makes_a_sample(seed, faults):
    decoder = Decoder()
    came = samples(decoder.feed(damage(LOG, faults, random.Random(seed))))
    assert came.items() <= SENT.items()


@given(st.sets(st.integers(0, 80), max_size=40))
def test_lost_lines_are_counted(dropped):
    lines = LOG.splitlines(keepends=True)
    kept = [line for index, line in enumerate(lines) if index not in dropped or index in (0, len(lines) - 1)]
    decoder = Decoder()
    came = samples(decoder.feed(b"".join(kept)))
    assert decoder.missing == len(lines) - len(kept)
    assert came.items() <= SENT.items()
    assert len(came) == sum(line.startswith(b"D") for line in kept)


@given(st.integers(0, 82), st.integers(1, 5))
def test_repeated_lines_are_taken_once(at, number):
    lines = LOG.splitlines(keepends=True)
    decoder = Decoder()
    messages = decoder.feed(b"".join(lines[: at + 1] + lines[max(0, at + 1 - number) : at + 1] + lines[at + 1 :]))
    assert samples(messages) == SENT and len(messages) == len(lines)
    assert decoder.repeated == min(number, at + 1)


@given(st.binary(max_size=300), st.integers(0, 82))
def test_noise_between_lines_costs_nothing_but_itself(noise, at):
    lines = LOG.splitlines(keepends=True)
    came = samples(Decoder().feed(b"".join(lines[:at]) + noise + b"\n" + b"".join(lines[at:])))
    assert came == SENT


def test_a_long_line_without_end_is_forgotten():
    decoder = Decoder()
    for _ in range(100):
        assert not decoder.feed(b"x" * 5000)
    assert len(decoder._torn) <= 200
    assert samples(decoder.feed(b"\n" + LOG)) == SENT


def test_numbers_go_round():
    assert samples(Decoder().feed(a_run(sequence=65500))) == SENT


def test_after_a_reset_numbers_begin_anew():
    decoder = Decoder()
    decoder.feed(LOG)
    [hello] = decoder.feed(b"\n" + seal("H 0 0 1/4 protocol=2"))
    assert isinstance(hello, Hello) and hello.command == 0
    assert samples(decoder.feed(seal("A 3 5") + a_run(sequence=4))) == SENT


def test_after_a_reset_that_nobody_heard_of_the_next_answer_tells():
    decoder = Decoder()
    decoder.feed(seal("A 30 4") + seal("A 31 5"))
    assert decoder.feed(seal("A 3 5")) == [], "an old answer, late"
    assert len(decoder.feed(seal("Q 4 6 0 idle 0 0 0 0 7380 0 0") + seal("A 5 7"))) == 2


def test_an_old_hello_changes_no_number():
    lines = LOG.splitlines(keepends=True)
    late = b"".join(lines[:30]) + seal("H 0 0 1/4 protocol=2") + b"".join(lines[30:])
    decoder = Decoder()
    assert samples(decoder.feed(late)) == SENT and decoder.missing == decoder.repeated == 0


def test_a_far_jump_is_believed_when_the_next_line_agrees():
    far = a_run(sequence=30_000)
    assert len(samples(Decoder().feed(LOG + far))) == len(SENT)
    decoder = Decoder()
    decoder.feed(LOG)
    assert decoder.feed(far.splitlines(keepends=True)[0]) == []
    assert len(decoder.feed(b"".join(far.splitlines(keepends=True)[1:3]))) == 2


def test_a_sample_whose_tick_does_not_fit_is_not_taken():
    decoder = Decoder()
    first = seal("B 1 7 0 0 step 0 100") + seal("D 2 0 0 170 0")
    assert len(decoder.feed(first + seal("D 3 0 7 170 9"))) == 2
    assert decoder.damaged == 1
    assert len(decoder.feed(seal("D 4 0 2 170 9"))) == 1


def test_right_checksum_wrong_fields_is_no_message():
    for text in ("D 1 2 3", "D 1 2 3 4 5 6 7", "Y 1 2", "D 70000 1 1 1 1", "D 1 1 1 +1 1", "H 1 1 1/4", ""):
        assert parse(seal(text).rstrip(b"\n")) is None
