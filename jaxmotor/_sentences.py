"""What comes from a stranger, as it may stand in a sentence: printable, quoted, and short."""

import difflib
import math
from collections.abc import Iterable
from typing import Any

LONGEST = 300
"""Characters of a sentence."""
LISTED = 120
"""Characters of a list of names within it."""
LINE = 110
"""Characters of a line on the terminal."""
_CUT = " ... "


def printable(text: str) -> str:
    """`text` without what would steer a terminal: control characters as their escapes."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)


def sentence(text: str, longest: int = LONGEST) -> str:
    """`text` in one printable line of at most `longest` characters, its middle left out where it has more."""
    # What is far too long is cut before it is looked at character by character, too.
    text = printable(_cut(text, 10 * longest))
    return _cut(text, longest)


def shown(value: Any, longest: int = 40) -> str:
    """A value as it may stand in a sentence: quoted, escaped, and at most `longest` characters of it."""
    if isinstance(value, bool) or value is None:
        return repr(value).lower()
    if isinstance(value, int):
        digits = int(value.bit_length() * math.log10(2))
        return repr(value) if digits < longest else f"a number of some {digits} digits"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "a table"
    text = value if isinstance(value, str) else str(value)
    return printable(repr(text if len(text) <= longest else text[: longest - 3] + "..."))


def one_of(names: Iterable[str], near: Any = "") -> str:
    """`names` as a list, of which only the nearest to what was given where all would be too long."""
    names = list(names)
    every = ", ".join(names)
    if len(every) <= LISTED:
        return every
    nearest = difflib.get_close_matches(str(near)[:LONGEST], names[:1000], n=3, cutoff=0.0)
    return sentence(f"{', '.join(nearest)}, or one of {len(names) - len(nearest)} more", LISTED)


def named(effect: str) -> str:
    """An effect's name, or what stands like one, as words."""
    return effect.replace("_", " ").replace("coulomb", "Coulomb")


def _cut(text: str, longest: int) -> str:
    if len(text) <= longest:
        return text
    head = (longest - len(_CUT)) // 2
    return text[:head] + _CUT + text[head + len(_CUT) - longest :]
