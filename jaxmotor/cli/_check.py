"""`jaxmotor check`: what a recording holds, and what weakens an estimate from it, without one."""

import json as json_module
import textwrap
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jaxmotor._sentences import LINE, printable
from jaxmotor.cli._recordings import for_each

if TYPE_CHECKING:
    from jaxmotor.recording import Recording


def check_command(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC.csv...", help="Recordings to check.")],
    json: Annotated[bool, typer.Option("--json", help="One JSON object per recording, one per line.")] = False,
) -> None:
    """Say what each recording holds and what weakens an estimate from it, before one is made."""
    for_each(recordings, lambda path: typer.echo(_checked(path, json)))


def _checked(path: Path, json: bool) -> str:
    from jaxmotor.recording import check, read

    recording = read(path)
    # First: a recording that it refuses may have nothing to tell.
    notes = check(recording)
    held = _held(recording)
    if json:
        return json_module.dumps({"format": 1, "recording": path.name, **held, "notes": notes})
    told = [_wrapped(f"{path.name}: {_sentence(held)}", "", "  ")]
    told += [_wrapped(note, "  - ", "    ") for note in notes] or ["  nothing to warn of"]
    return "\n".join(told)


def _wrapped(text: str, first: str, later: str) -> str:
    return textwrap.fill(printable(text), LINE, initial_indent=first, subsequent_indent=later, break_on_hyphens=False)


def _held(recording: "Recording") -> dict[str, Any]:
    import numpy as np

    from jaxmotor.recording import lost_ticks, mean_speeds

    segments = recording.segments
    volts = np.concatenate([segment.volts for segment in segments])
    speeds = np.concatenate([mean_speeds(recording, segment) for segment in segments])
    return {
        "measured": recording.measured,
        "rows": sum(map(len, segments)),
        "segments": dict(Counter(segment.kind for segment in segments)),
        "duration_s": float(sum(segment.time_s[-1] - segment.time_s[0] for segment in segments)),
        "period_s": recording.period_s,
        "lost_ticks": None if recording.period_s is None else sum(map(lost_ticks, segments)),
        "volts_V": [float(volts.min()), float(volts.max())],
        "speed_rad_s": [float(speeds.min()), float(speeds.max())],
    }


def _sentence(held: dict[str, Any]) -> str:
    kinds = ", ".join(f"{number} {kind}" for kind, number in held["segments"].items())
    number = sum(held["segments"].values())
    paced = "at uneven times"
    if held["period_s"] is not None:
        paced = f"one per {1e3 * held['period_s']:.4g} ms, {held['lost_ticks']} lost"
    (low, high), (slow, fast) = held["volts_V"], held["speed_rad_s"]
    return (
        f"{held['measured']}; {held['rows']} rows in {number} segment{'s' if number > 1 else ''} ({kinds}), "
        f"{held['duration_s']:.4g} s, {paced}; {low:.4g} to {high:.4g} V, {slow:.4g} to {fast:.4g} rad/s"
    )
