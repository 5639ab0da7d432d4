"""Segments that people name: by number, by range, by kind."""

import re
from collections.abc import Iterable, Mapping

import numpy as np

from jaxmotor._sentences import shown
from jaxmotor.recording._recording import KINDS, Recording, RecordingError

NUMBERS = r"(-?\d{1,9})(?:-(\d{1,9}))?"
Which = str | int | Iterable[str | int]


def chosen_segments(recording: Recording, which: Which | None) -> tuple[int, ...]:
    """Indices, in order, of the segments that `which` names: numbers, or texts such as "3,7-9,step".

    **Raises:** `RecordingError` for a number or kind that the recording lacks, and for what names none.
    """
    parts = [which] if isinstance(which, str | bytes | Mapping) or not isinstance(which, Iterable) else which
    return tuple(sorted({index for part in parts if part is not None for index in _chosen(recording, part)}))


def names_segments(text: str) -> bool:
    """`text` is made of one or more numbers, ranges and kinds, whatever recording has them."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    return bool(parts) and all(part in KINDS or re.fullmatch(NUMBERS, part) for part in parts)


def _chosen(recording: Recording, part: object) -> Iterable[int]:
    number = len(recording.segments)
    if isinstance(part, str) and "," in part and part.strip(", "):
        return chosen_segments(recording, [piece for piece in part.split(",") if piece.strip()])
    text = str(part).strip() if isinstance(part, str | int | np.integer) and not isinstance(part, bool) else "no number"
    if text in KINDS:
        found = [index for index, segment in enumerate(recording.segments) if segment.kind == text]
        if not found:
            raise RecordingError(f"{recording.name}: has no segment of kind {text!r}")
        return found
    numbers = re.fullmatch(NUMBERS, text)
    if text and numbers is None:
        raise RecordingError(
            f"{shown(part)} names no segments of {recording.name}; give numbers, ranges or kinds, such as '3,7-9,step'"
        )
    first, last = (int(numbers[1]), int(numbers[2] or numbers[1])) if numbers else (0, -1)
    if numbers and not 0 <= first <= last < number:
        raise RecordingError(f"{recording.name}: there is no segment {text} to hold out; they are 0 to {number - 1}")
    return range(first, last + 1)
