"""Segments named on the command line."""

import typer

from jaxmotor._errors import JaxmotorError
from jaxmotor.recording import KINDS, Recording


def chosen_segments(recording: Recording, text: str | None) -> tuple[int, ...]:
    """Indices that `text` names: numbers, ranges and kinds, with commas between (`3,7-9,step`).

    **Raises:** `JaxmotorError` for a number or kind that the recording lacks; wrong usage for anything else.
    """
    if not text:
        return ()
    chosen: set[int] = set()
    for part in (part.strip() for part in text.split(",")):
        chosen |= set(_kind(recording, part) if part in KINDS else _range(recording, part))
    return tuple(sorted(chosen))


def _kind(recording: Recording, kind: str) -> list[int]:
    indices = [index for index, segment in enumerate(recording.segments) if segment.kind == kind]
    if not indices:
        raise JaxmotorError(f"{recording.name}: has no segment of kind {kind!r}")
    return indices


def _range(recording: Recording, part: str) -> range:
    first, _, last = part.partition("-")
    if not first.isdecimal() or (last and not last.isdecimal()) or part.endswith("-"):
        raise typer.BadParameter(f"{part!r} names no segments; write numbers, ranges or kinds, such as 3,7-9,step")
    low, high = int(first), int(last or first)
    if low > high or high >= len(recording.segments):
        raise JaxmotorError(f"{recording.name}: has no segments {part}; they are 0 to {len(recording.segments) - 1}")
    return range(low, high + 1)
