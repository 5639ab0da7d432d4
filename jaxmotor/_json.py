"""What JSON can hold."""

import math
from typing import Any


def plain(value: Any) -> Any:
    """`value` of dicts, sequences, texts and numbers, with null for what is no number: JSON has no NaN."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
