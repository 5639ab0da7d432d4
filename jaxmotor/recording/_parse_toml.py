"""Reads TOML of a stranger: no more nesting and no larger whole numbers than a header or a plan can mean."""

import re
import tomllib
from typing import Any

from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._text import fault

MAX_DEPTH = 30
"""Deeper nesting is refused."""
_LINE = re.compile(r" \(at line ([0-9]+), column [0-9]+\)$")
# tomllib takes time with the square of a key's parts.
_LONG_KEY = re.compile(rf"(?<![\w\"'-])(?:(?:[\w-]+|\"[^\"\n]*\"|'[^'\n]*')[ \t]*\.[ \t]*){{{MAX_DEPTH}}}")


def parse_toml(text: str, source: str, what: str) -> dict[str, Any]:
    """The values in `text`, which is `what` (such as "the header") of the file `source`.

    **Raises:** `RecordingError` where it is not TOML, is nested deeper than `MAX_DEPTH`, or has whole numbers beyond
    64 bits.
    """
    too_deep = f"{source}: {what} is nested deeper than {MAX_DEPTH} levels; flatten it"
    if _LONG_KEY.search(text):
        raise RecordingError(too_deep)
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = _LINE.search(str(error))
        line = int(match.group(1)) if match else text.count("\n") + 1
        reason = str(error)[: match.start()] if match else str(error)
        reason = reason if len(reason) <= 80 else shown(reason, 80)
        raise fault(source, line, f"{what} is not TOML ({reason}); correct the line, as key = value") from error
    except ValueError as error:  # an integer of thousands of digits, a date that is none
        raise RecordingError(f"{source}: {what} has a value out of range ({error}); correct it") from error
    except RecursionError:
        raise RecordingError(too_deep) from None
    level: list[Any] = [values]
    for _ in range(MAX_DEPTH):
        items = [item for part in level for item in (part.values() if isinstance(part, dict) else part)]
        if any(isinstance(item, int) and not -(2**63) <= item < 2**63 for item in items):
            raise RecordingError(f"{source}: {what} has a whole number beyond 64 bits; correct it or put it in quotes")
        level = [item for item in items if isinstance(item, dict | list)]
        if not level:
            return values
    raise RecordingError(too_deep)
