"""Indices as a person writes them."""

from collections.abc import Iterable


def ranges(indices: Iterable[int]) -> str:
    """Rising `indices` with runs drawn together: `0-3, 7`."""
    runs: list[list[int]] = []
    for index in indices:
        if runs and index == runs[-1][1] + 1:
            runs[-1][1] = index
        else:
            runs.append([index, index])
    return ", ".join(f"{first}-{last}" if last > first else f"{first}" for first, last in runs)
