"""Runs that the board stops, each with any one line lost: does the reason reach the user?

    python benchmarks/stop_reasons.py [--share 1.0] [--seed 1]

docs/reliability.md holds the figures of a full run.
"""

import argparse
import dataclasses
import random
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from testing.line import Board, Fault, FaultyPort

from jaxmotor.bench import RecorderError, parse_plan, record
from jaxmotor.bench._protocol import Sample, checksum, parse

STEP = """
period_ms = 20
rest_s = 0.1
travel_rev = {travel}
[[experiment]]
kind = "step"
amplitude_V = [3, 5]
duration_s = 1.4
"""


@dataclasses.dataclass(frozen=True)
class Stop:
    """A run that does not come to its end, and what the sentence must have."""

    options: tuple[str, ...]
    said: str
    travel_rev: float = 1000
    check: bool = False
    rewrite: Callable[[bytes], bytes] = bytes
    """Of what the board says."""


def jumped(line: bytes) -> bytes:
    """A sample whose count is 5000 too large from tick 20 of segment 1 on, as after a burst of false edges."""
    message = parse(line.strip())
    if not isinstance(message, Sample) or message.segment < 1 or (message.segment == 1 and message.tick < 20):
        return line
    fields = line.rpartition(b"*")[0].split(b" ")
    fields[5] = str(message.count + 5000).encode()
    body = b" ".join(fields)
    return body + b"*" + checksum(body) + b"\n"


STOPS = {
    "stalled": Stop(("--set", "wiring.jammed_at_s=1.2"), "the shaft is stuck"),
    "low_supply": Stop(("--set", "battery.cutoff_at_s=1.2", "--set", "battery.cutoff_V=4"), "supply fell"),
    "host_silent": Stop(("--keepalive-until", "1.2"), "250 ms"),
    "travel_limit": Stop((), "travel limit", travel_rev=2),
    "watchdog": Stop(("--hang-at", "1.2"), "watchdog"),
    "wiring": Stop(("--set", "wiring.encoder_swapped=true"), "swapped", check=True),
    "encoder unplugged": Stop(("--set", "wiring.unplugged_at_s=0"), "encoder is dead", check=True),
    "count jump": Stop((), "jump", rewrite=jumped),
}


class RewrittenPort(FaultyPort):
    """What the board says passes through `rewrite`, line by line, before it suffers."""

    def __init__(self, url: str, faults: tuple[Fault, ...], rewrite: Callable[[bytes], bytes]) -> None:
        self._rewrite = rewrite
        super().__init__(url, faults)

    def _pass(self, line: bytes, *, by_host: bool) -> bytes:
        return super()._pass(line if by_host else self._rewrite(line), by_host=by_host)


def sentence(stop: Stop, faults: tuple[Fault, ...], folder: Path) -> tuple[str, FaultyPort]:
    """What `record` says of a run that is stopped so, under these faults; and the port it went through."""
    ports: list[FaultyPort] = []
    plan = parse_plan(STEP.format(travel=stop.travel_rev), "stop")
    with Board("--set", "bench.seed=3", *stop.options, once=True) as board:

        def opened() -> FaultyPort:
            ports.append(RewrittenPort(board.url, faults, stop.rewrite))
            return ports[-1]

        said = ""
        try:
            record(plan, opened, folder / "r.csv", check=stop.check, force=True)
        except RecorderError as error:
            said = str(error)
    return said, ports[-1]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of the lines that are lost, drawn at random")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as name:
        for word, stop in STOPS.items():
            said, port = sentence(stop, (), Path(name))
            points = [point for point in port.points if point[1] and rng.random() < options.share]
            told: Counter[bool] = Counter({stop.said in said: 1})
            others = [said] if stop.said not in said else []
            for point in points:
                said, _ = sentence(stop, (Fault(*point, "lost"),), Path(name))
                told[stop.said in said] += 1
                others += [f"{point}: {said}"] if stop.said not in said else []
            print(f"{word}: {told[True]} of {told.total()} told", flush=True)
            for other in others[:5]:
                print(f"  {other}", flush=True)


if __name__ == "__main__":
    main()
