"""Logs as the programs of small boards print them, imported as their users would."""

import dataclasses

import numpy as np

from testing.board_motor import BoardMotor, draw_motor
from testing.board_programs import FRICTION, PROGRAMS


@dataclasses.dataclass(frozen=True)
class BoardLog:
    """What was printed, and what `jaxmotor import` is told about it."""

    text: str
    flags: tuple[str, ...]
    motor: BoardMotor
    wanted: tuple[frozenset[str], ...]
    """Of each set one effect is to be named."""
    allowed: frozenset[str]
    """Names that are no fault beside them."""


def draw_log(name: str, seed: int) -> BoardLog:
    """What the program `name` of `PROGRAMS` prints with a motor drawn by `seed`."""
    rng = np.random.default_rng([seed, *name.encode()])
    motor = draw_motor(rng)
    printed = PROGRAMS[name](motor, rng)
    wanted = (*([FRICTION] if printed.shows_friction else []), *printed.wanted)
    return BoardLog("\n".join(printed.lines) + "\n", tuple(printed.flags), motor, wanted, printed.allowed | FRICTION)
