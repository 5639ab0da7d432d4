"""Indices as a person writes them."""

from collections.abc import Iterable

LEAST_TO_SKIP = 4
"""Indices at equal distances from which the middle ones are left out."""


def ranges(indices: Iterable[int]) -> str:
    """Rising `indices` with runs drawn together: `0-3, 7`, and `1, 3, ..., 31` where every second is meant."""
    left, parts = list(indices), []
    while left:
        size = _run(left)
        step = left[1] - left[0] if size > 1 else 0
        if step == 1:
            parts.append(f"{left[0]}-{left[size - 1]}")
        elif size >= LEAST_TO_SKIP:
            parts.append(f"{left[0]}, {left[1]}, ..., {left[size - 1]}")
        else:
            size = 1
            parts.append(str(left[0]))
        left = left[size:]
    return ", ".join(parts)


def _run(indices: list[int]) -> int:
    """How many of `indices`, from the first on, stand at one distance from each other."""
    size = min(2, len(indices))
    while size < len(indices) and indices[size] - indices[size - 1] == indices[1] - indices[0]:
        size += 1
    return size
