"""What JSON can hold."""

import math
from collections.abc import Callable
from typing import Any


def plain(value: Any, text: Callable[[str], str] | None = None) -> Any:
    """`value` of dicts, sequences, texts and numbers, with null for what is no number: JSON has no NaN.

    Values that are texts are taken through `text`, where that is given.
    """
    if isinstance(value, dict):
        return {key: plain(item, text) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, text) for item in value]
    if text is not None and isinstance(value, str):
        return text(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value
