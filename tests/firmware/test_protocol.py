"""What the board says and how it answers."""

import re
from pathlib import Path

import pytest
from live import Live
from testing.wire import Script, hertz, level, seal, seal_bytes, unseal


def hello_of(outcome, number):
    pairs = {}
    for line in outcome.of("H"):
        if line.fields[0] == str(number):
            pairs |= dict(field.split("=") for field in line.fields[2:])
    return pairs


def test_hello_tells_what_the_host_needs(bench):
    hello = hello_of(bench(seal("H 7")), 7)
    assert hello == {
        "protocol": "2",
        "firmware": "2.0.0",
        "clock_Hz": "16000000",
        "tick_us": "1000",
        "period_max": "20",
        "full_scale": "250",
        "pwm_Hz": "4000",
        "duty_delay_us": "40",
        "counts_per_rev_milli": "617400",
        "slots": "60",
        "tones": "8",
        "host_silent_ms": "250",
        "stall_ms": "1000",
        "stall_duty": "125",
        "adc_step_uV": "19679",
        "supply_mV": hello["supply_mV"],
        "supply_min_mV": "6000",
        "reset": "power",
        "run": "0",
    }
    assert abs(int(hello["supply_mV"]) - 7400) <= 20


def test_a_person_needs_no_checksum_for_hello_and_stop(bench):
    outcome = bench(b"H\nX\nG 1 7 0 0\n")
    assert sorted(line.type for line in outcome.lines) == ["A"] + ["H"] * 8


def test_sequence_numbers_run_without_gap(bench):
    outcome = bench(bytes(Script().add("step", 50, b=level(100)).go()))
    assert [line.sequence for line in outcome.lines] == list(range(len(outcome.lines)))


@pytest.mark.parametrize(
    ("command", "word"),
    [
        ("P 1 0 0", "argument"),
        ("P 1 21 0", "argument"),
        ("P 1 5 2", "argument"),
        ("P 1 5", "argument"),
        ("P 1 5 0 1", "argument"),
        ("L 1 0 1 1", "argument"),
        ("S 1 0 sine 0 100 1 32001 0", "argument"),  # beyond full scale
        ("S 1 0 sine 0 100 1 20000 20000", "argument"),
        ("S 1 0 sine 0 1 1 100 0", "argument"),  # too short to prepare the next
        ("S 1 0 noise 0 100 1 100 0", "argument"),
        ("S 1 0 multisine 0 100 1 100 265", "argument"),  # nine tones
        ("S 1 0 prbs 0 100 264 100 0", "argument"),  # no register of 8 bits
        ("S 1 0 loop 0 100 1 16385 0", "argument"),
        ("S 1 0 prbs 0 100 65798 100 0", "argument"),  # 257 ticks per bit
        ("S 1 0 multisine 0 100 1 100 256", "argument"),  # no tone
        ("S 1 0 step 0 100 0 100 1", "argument"),  # a step has no c
        ("S 1 0 step 4294967296 100 0 100 0", "argument"),  # 2^32
        ("S 1 0 step 0 4294967299 0 100 0", "argument"),
        ("S 1 0 sine 0 100 4294967296 100 0", "argument"),
        ("S 1 0 sine 0 100 -1 100 0", "argument"),
        ("S 1 0 sine 0 100 1 4294967396 0", "argument"),
        ("S 1 4294967296 sine 0 100 1 100 0", "argument"),
        ("P 1 4294967301 0", "argument"),
        ("L 1 4294967297 1 1", "argument"),
        ("L 1 1 4294967297 1", "argument"),
        ("S 1 0 step 0 100 0 100 0", "order"),  # for which run?
        ("C 1 0", "old"),
        ("C 1 4294967296", "argument"),
        ("G 1 7 0 65536", "argument"),
        ("G 1 7 0 0", "order"),
        ("U 1 57600", "argument"),
        ("J 1 7 0", "idle"),
        ("J 1", "argument"),
        ("Y 1", "unknown"),
        ("X 1 1", "argument"),
        ("H 1 1", "argument"),
        ("Q 1 1", "argument"),
        ("R 1 60", "argument"),
    ],
)
def test_refusals(bench, command, word):
    outcome = bench(seal(command))
    [line] = outcome.of("N")
    assert line.fields == ("1", word)
    assert not outcome.of("A")


def test_a_number_is_taken_whole_or_not_at_all(bench):
    """The largest that fit, and the first that do not."""
    for b, word in ((2**31 - 1, "A"), (-(2**31), "A"), (2**31, "N"), (-(2**31) - 1, "N")):
        outcome = bench(seal("C 1 7") + seal(f"S 2 0 chirp 0 100 4294967295 {b} 100"))
        assert [line.type for line in outcome.lines if line.fields[0] == "2"] == [word]


@pytest.mark.parametrize("line", [b"\x00 1", b"C\x00 1 7", b"C 1 7\x00", b"C 1 \xb7", b"\tC 1 7"])
def test_what_is_no_text_is_no_command(bench, line):
    outcome = bench(seal_bytes(line) + seal("Q 2"))
    assert not outcome.of("A") and not outcome.of("N")
    assert int(outcome.of("Q")[0].fields[8]) == 1


def test_a_line_without_a_number_is_answered_to_none(bench):
    outcome = bench(seal("C") + seal("C 65536 7") + seal("C x 7"))
    assert [line.fields for line in outcome.of("N")] == [("0", "argument")] * 3


def test_a_run_is_started_once_however_often_it_is_asked_for(bench):
    script = Script().add("step", 10, b=level(50), rest=10).go()
    go = script.lines[-1]
    outcome = bench(bytes(script) + go + seal("Q 90") + go + go)
    assert outcome.end == "done" and len(outcome.of("D")) == 20
    assert [line.fields[0] for line in outcome.of("A")].count(go.split()[1].decode()) == 4
    assert not outcome.of("N")


def test_an_older_run_is_not_started_again(bench):
    first, second = Script(run=7).add("step", 10, b=level(50)).go(), Script(run=9, first=40).add("step", 5, b=99).go()
    outcome = bench(bytes(first) + bytes(second) + bytes(first))
    assert [line.run for line in outcome.of("Z")] == [7, 9]
    assert {line.fields[1] for line in outcome.of("N")} == {"old", "order"}


def test_go_starts_what_was_meant_or_nothing(bench):
    """A slot, the period or the limits that were changed behind the host's back."""
    for late in ("S 90 0 step 0 10 0 12800 0", "P 91 1 0", "L 92 5 5 0"):
        script = Script().command("P 5 0").command("L 1000 1000 0").add("step", 10, b=level(50))
        script.lines.append(seal(late))
        outcome = bench(bytes(script.go()))
        assert outcome.of("N")[-1].fields[1] == "plan" and not outcome.of("D")


def test_status_and_account(bench):
    script = Script().command("P 5 0").command("L 9000000 300 0")
    script.add("step", 10, b=level(50), rest=7).add("rest", 20).add("step", 300, b=level(50), rest=4)
    outcome = bench(bytes(script.add("rest", 9).add("rest", 9).go()) + seal("Q 90") + seal("R 91 0") + seal("R 92 4"))
    assert outcome.end == "time_limit"
    [status] = outcome.of("Q")
    assert status.fields[:5] == ("90", "7", "time_limit", "60", "5")
    accounts = [line.ints()[1:] for line in outcome.of("R")]
    assert accounts == [[7, 0, 7, 10, 0, 20, 4, 19, 0, 0], [7, 4, 0, 0]]


def test_an_account_is_of_the_run_that_it_names(bench):
    script = Script().add("step", 10, b=level(50), rest=7).go()
    fresh = Script(run=8, first=50).add("step", 20, b=level(50))
    outcome = bench(seal("R 40 0") + seal("Q 41") + bytes(script) + bytes(fresh) + seal("R 42 0"))
    assert outcome.of("Q")[0].fields[1:4] == ("0", "idle", "0")
    assert [line.ints()[1:] for line in outcome.of("R")] == [[0, 0], [7, 0]]


def test_a_skip_said_twice_skips_once(build):
    with Live(build) as board:
        board.send(bytes(Script().add("step", 60000, b=level(100)).add("step", 400, b=level(50)).go()))
        board.until(lambda line: line.type == "D" and line.fields[1] == "40")
        board.send(seal("J 99 7 0") * 3)
        board.until(lambda line: line.type == "D" and line.fields[:2] == ("1", "5"))
        board.send(seal("J 99 7 0"))
        lines = board.until(lambda line: line.type == "Z")
    assert [(line.fields[1], int(line.fields[2]) == 400) for line in lines if line.type == "E"] == [
        ("skipped", False),
        ("done", True),
    ]


def test_plan_is_full_after_its_last_slot(bench):
    script = Script()
    for _ in range(61):
        script.add("step", 2, b=100)
    outcome = bench(bytes(script))
    assert len(outcome.of("A")) == 1 + 60
    assert outcome.of("N")[0].fields == ("62", "full")


def test_a_slot_sent_twice_is_one_slot(bench):
    script = Script().add("step", 10, b=level(50))
    script.lines.append(script.lines[-1])
    outcome = bench(bytes(script.go()))
    assert outcome.end == "done"
    assert len(outcome.of("B")) == 1


def test_go_must_name_the_number_of_slots(bench):
    script = Script().add("step", 10, b=level(50))
    outcome = bench(bytes(script.command(f"G 7 2 {script.sum}")))
    assert outcome.of("N")[0].fields[1] == "plan"
    assert not outcome.of("D")


def test_damaged_commands_do_nothing(bench):
    good = seal("P 1 5 0")
    damaged = [good[:k] + bytes([good[k] ^ 1]) + good[k + 1 :] for k in range(len(good) - 1)]
    damaged += [good[:k] + good[k + 1 :] for k in range(len(good) - 1)]
    outcome = bench(b"".join(damaged) + seal("Q 2"))
    assert not outcome.of("A") and not outcome.of("N")
    assert int(outcome.of("Q")[0].fields[8]) == len(damaged)


def test_overlong_line_is_ignored_and_the_next_one_heard(bench):
    outcome = bench(b"x" * 500 + b"\n" + seal("P 1 5 0"))
    assert outcome.of("A")[0].fields == ("1",)


def test_every_line_fits_the_room_reserved_for_it(bench, build):
    source = (build.parent / "motor_rig" / "report.c").read_text()
    room = {name: int(value) for name, value in re.findall(r"#define (\w+)_ROOM (\d+)", source)}
    script = Script(run=2**32 - 1).command("H").command("P 20 0")
    script.add("multisine", 300, 1, level(-200), 264, rest=65535).go()
    outcome = bench(bytes(script), "--keepalive-until", "3")
    longest = {}
    for line in filter(None, outcome.raw.splitlines()):
        kind = chr(line[0])
        longest[kind] = max(longest.get(kind, 0), len(line) + 1)
    # What is short here may have more digits elsewhere: sequence 5, count and time 10 or 11, losses 5 each.
    assert longest["H"] + 8 <= room["HELLO"]
    assert longest["D"] + 14 <= room["SAMPLE"]
    assert max(longest[kind] for kind in "BEZ") + 30 <= room["EVENT"]


def test_baud_rate_by_command(bench):
    outcome = bench(bytes(Script().command("U 500000").command("P 1 0").add("step", 500, b=level(100)).go()))
    assert len(outcome.samples(0)) == 500
    assert outcome.of("Z")[0].fields == ("done", "500", "0", "0")


def test_lines_that_do_not_fit_are_dropped_and_counted(bench):
    outcome = bench(bytes(Script().command("P 1 0").add("step", 2000, b=level(100)).go()))
    ticks = [sample[0] for sample in outcome.samples(0)]
    lost = int(outcome.of("Z")[0].fields[3])
    assert lost == 2000 - len(ticks) > 500
    assert ticks == sorted(set(ticks))
    # What was sent is sound, and the last lines came through.
    assert outcome.of("E")[0].fields[1:3] == ("done", "2000")
    unused = outcome.lines[-1].sequence + 1 - len(outcome.lines)
    assert unused == lost


def test_more_segments_than_the_line_can_carry(bench):
    """Even begins and ends are then lost, and counted; the run's end is not."""
    script = Script().command("P 1 0")
    for _ in range(60):
        script.add("step", 2, b=level(100))
    outcome = bench(bytes(script.go()))
    [end] = outcome.of("Z")
    assert end.fields[:2] == ("done", "120")
    told = len(outcome.of("B")) + len(outcome.of("D")) + len(outcome.of("E"))
    assert told + int(end.fields[3]) == 60 + 120 + 60
    assert 0 < told < 240


def test_short_segments_at_full_speed(bench):
    script = Script().command("P 1 0").command("U 1000000")
    for _ in range(60):
        script.add("step", 2, b=level(100))
    outcome = bench(bytes(script.go()))
    assert outcome.of("Z")[0].fields == ("done", "120", "0", "0")


def test_documented_lines_are_right():
    """Every line in docs/protocol.md and docs/wiring.md has its checksum."""
    docs = Path(__file__).parents[2] / "docs"
    lines = []
    for name in ("protocol.md", "wiring.md"):
        text = (docs / name).read_text()
        lines += re.findall(r"`([A-Z](?: [^`*\n]*)?\*[0-9A-F.]{4})`", text)
        lines += re.findall(r"(?m)^    [> ] ([A-Z](?: [^*\n]*)?\*[0-9A-F.]{4})$", text)
    assert len(lines) > 30
    for line in lines:
        assert line == seal(line[:-5]).decode().strip()


def test_skip_ends_one_segment(build):
    with Live(build) as board:
        board.send(bytes(Script().add("step", 60000, b=level(100)).add("sine", 20, hertz(5, 0.005), level(50)).go()))
        board.until(lambda line: line.type == "D" and line.fields[1] == "40")
        board.send(seal("J 99 7 0"))
        lines = board.until(lambda line: line.type == "Z")
    ends = [line.fields[1] for line in lines if line.type == "E"]
    assert ends == ["skipped", "done"]
    assert lines[-1].fields[0] == "done"


def test_stop_ends_the_run(build):
    with Live(build) as board:
        board.send(bytes(Script().add("step", 60000, b=level(100)).go()))
        board.until(lambda line: line.type == "D" and line.fields[1] == "40")
        board.send(b"X\n")
        lines = board.until(lambda line: line.type == "Z")
    assert lines[-1].fields[0] == "stopped"


def test_unseal_refuses_what_is_not_whole():
    whole = seal("D 1 0 0 0 0")
    assert unseal(whole) is not None
    assert all(unseal(whole[:k]) is None for k in range(len(whole) - 1))
