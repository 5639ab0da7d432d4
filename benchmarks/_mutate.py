"""Structured damage to plans, plants and models: a value, a key or a byte is not what it should be."""

import copy
import datetime
import random
from collections.abc import Callable
from typing import Any

from jaxmotor.recording._toml import toml_lines

Tree = dict[str, Any]
Slot = tuple[Any, Any]
"""A container, and the key or index of one of its values."""

ESCAPE = "\x1b[31m\x1b]0;title\x07"
STRANGE = (
    *(0, 1, -1, 2**31, 2**32, 2**63, -(2**63), 9223372036854775808, 10**20, 10**400, -(10**400)),
    *(0.0, -0.0, 1e-320, 1e-12, 1e-3, 0.5, 1e3, 1e9, 1e30, 1e154, 1e308, -1e308, float("nan"), float("inf")),
    *(True, False, "", "x", "7.4", "x" * 3000, ESCAPE, "\u202eabc", "a\nb", "ü" * 500, "\x00"),
    *([], {}, [[]], [1, 2, 3], {"a": 1}, [1e308, -1e308], ["x", 1], datetime.date(2026, 1, 1)),
)
NAMES = ("x", "x" * 3000, ESCAPE, "", "a.b", "a b", "__class__", "format", "kind", "\u202eabc", "[", "é")
DEPTHS = (20, 500, 100_000)


def slots_of(tree: Any) -> list[Slot]:
    """Each place in `tree` that holds a value."""
    found: list[Slot] = []
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in keys:
        found.append((tree, key))
        found += slots_of(tree[key])
    return found


def change_type(rng: random.Random, tree: Tree) -> None:
    """A value becomes another of whatever type."""
    container, key = rng.choice(slots_of(tree))
    container[key] = copy.deepcopy(rng.choice(STRANGE))


def change_size(rng: random.Random, tree: Tree) -> None:
    """A number becomes much larger, much smaller, or negative."""
    numbers = [(c, k) for c, k in slots_of(tree) if isinstance(c[k], int | float) and not isinstance(c[k], bool)]
    container, key = rng.choice(numbers or slots_of(tree))
    factor = rng.choice((-1.0, 0.0, 1e-300, 1e-30, 1e-9, 1e-3, 0.1, 10.0, 1e3, 1e9, 1e30, 1e300))
    container[key] = container[key] * factor if numbers else factor


def delete_key(rng: random.Random, tree: Tree) -> None:
    """A key, or an item of a list, is not there."""
    container, key = rng.choice(slots_of(tree))
    del container[key]


def double_value(rng: random.Random, tree: Tree) -> None:
    """A list is longer by one item of its own, or a value stands under a second name."""
    container, key = rng.choice(slots_of(tree))
    if isinstance(container, list):
        container.insert(rng.randrange(len(container) + 1), copy.deepcopy(container[key]))
    else:
        container[f"{key}_"] = copy.deepcopy(container[key])


def rename_key(rng: random.Random, tree: Tree) -> None:
    """A key has another name."""
    tables = [(c, k) for c, k in slots_of(tree) if isinstance(c, dict)]
    container, key = rng.choice(tables)
    container[rng.choice(NAMES)] = container.pop(key)


def nest(rng: random.Random, tree: Tree) -> None:
    """A value is wrapped in a list or a table, or stands many times in one list."""
    container, key = rng.choice(slots_of(tree))
    value = container[key]
    container[key] = rng.choice(([value], {"a": value}, [value] * 300, [copy.deepcopy(value)] * 20_000))


def swap_values(rng: random.Random, tree: Tree) -> None:
    """Two values stand in each other's places."""
    (first, a), (second, b) = rng.choice(slots_of(tree)), rng.choice(slots_of(tree))
    value, other = copy.deepcopy(first[a]), copy.deepcopy(second[b])
    first[a] = other
    if b in second if isinstance(second, dict) else b < len(second):
        second[b] = value


def flip_bytes(rng: random.Random, data: bytes) -> bytes:
    """Some bytes are others."""
    damaged = bytearray(data)
    for _ in range(rng.choice((1, 1, 3, 30))):
        damaged[rng.randrange(len(damaged))] = rng.choice(
            (rng.randrange(256), *rng.sample(b"0123456789-.eE", 4), 0, 0x1B)
        )
    return bytes(damaged)


def truncate(rng: random.Random, data: bytes) -> bytes:
    """The file ends early."""
    return data[: rng.randrange(len(data))]


def double_lines(rng: random.Random, data: bytes) -> bytes:
    """Some lines stand twice, or in another order."""
    lines = data.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    lines.insert(rng.randrange(len(lines) + 1), lines[at] * rng.choice((1, 1, 2, 1000)))
    return b"".join(lines)


def put_in(rng: random.Random, data: bytes) -> bytes:
    """Something that does not belong there stands in the middle."""
    depth = rng.choice(DEPTHS)
    many = [part * depth for part in (b"[", b'{"a":', b"a.", b"9", b"x")]
    piece = rng.choice((*many, ESCAPE.encode(), b"\n", b'"', b"\xff"))
    at = rng.randrange(len(data) + 1)
    return data[:at] + piece + data[at:]


CHANGES: dict[str, Callable[[random.Random, Tree], None]] = {
    "type": change_type,
    "size": change_size,
    "key deleted": delete_key,
    "doubled": double_value,
    "renamed": rename_key,
    "nested": nest,
    "swapped": swap_values,
}
DAMAGES: dict[str, Callable[[random.Random, bytes], bytes]] = {
    "bytes": flip_bytes,
    "truncated": truncate,
    "lines": double_lines,
    "put in": put_in,
}
HOW = (*CHANGES, *DAMAGES)


def mutated(how: str, rng: random.Random, tree: Tree, write: Callable[[Tree], str]) -> bytes:
    """The bytes of `tree` as `write` makes them, damaged as `how` says by draws of `rng`."""
    if how in DAMAGES:
        return DAMAGES[how](rng, write(tree).encode())
    changed = copy.deepcopy(tree)
    CHANGES[how](rng, changed)
    return write(changed).encode("utf-8", "surrogatepass")


def to_toml(tree: Tree) -> str:
    """`tree` in TOML: a table or a list of tables stands under its own heading."""
    lines, later = [], []
    for key, value in tree.items():
        tables = value if isinstance(value, list) else [value]
        if tables and all(isinstance(table, dict) for table in tables):
            mark = "[[{}]]" if isinstance(value, list) else "[{}]"
            later += [line for table in tables for line in (mark.format(_heading(key)), *toml_lines(table))]
        else:
            lines += toml_lines({key: value})
    return "\n".join([*lines, *later, ""])


def _heading(key: str) -> str:
    return toml_lines({key: 0})[0].removesuffix(" = 0")
