"""One compiled program for many motors: in it, effects that a motor lacks are there, but neutral.

To compile a program takes as long as to run it a hundred times, and a search fits some fifty combinations of effects.
A neutral effect changes nothing and, where its law is simple, costs little.
"""

import functools
from typing import Literal

import equinox as eqx
import jax
import numpy as np

from jaxmotor.diagnosis._free import is_wide
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import BUILT_IN, LEARNED, OF_LOG, AbstractEffect, SpeedWindow

Sharing = Literal["nothing", "simple", "most"]
"""Which effects motors have in common in the programs of one log: none, in long ones; those of a `program_level`; or,
where the log is short and one sequence, also those that are `cheap_alone`, and all learned curves once there is one."""


def as_shared(motors: Motor, sharing: Sharing, window_s: float | None = None) -> Motor:
    """`motors`, whose leaves are (k,), with all effects that share a program with its own, in one order; and where
    speeds are means over `window_s`, with that as if it were sought."""
    names = shared_names(motors, sharing)
    if names is None:
        return motors
    own = {effect.name: effect for effect in motors.effects}
    number = len(np.asarray(motors.linear.gain))
    window = [] if window_s is None else [SpeedWindow.of(length_s=window_s)]
    every = _neutral(names, number) | {one.name: _repeated(one, number) for one in window} | own
    return eqx.tree_at(lambda motor: motor.effects, motors, tuple(every[name] for name in sorted(every)))


def shared_names(motor: Motor, sharing: Sharing) -> frozenset[str] | None:
    """The effects in the program of `motor`, neutral where it lacks them: those up to the highest `program_level` of
    its own. None where it has a program of its own.

    Without effects but the log's that is so: a linear motor needs no steps. So it is with a contact, whose steps are
    many, where no more than `simple` effects are shared.
    """
    own = [effect for effect in motor.effects if not isinstance(effect, OF_LOG)]
    if not own or sharing == "nothing" or (is_wide(motor.effects) and sharing == "simple"):
        return None
    level = max((effect.program_level for effect in own if effect.program_level is not None), default=0)
    names = {one.name for one in BUILT_IN.values() if one.program_level is not None and one.program_level <= level}
    if sharing == "most":
        names |= {one.name for one in BUILT_IN.values() if one.cheap_alone}
        names |= LEARNED.keys() if any(effect.name in LEARNED for effect in own) else set()
    return frozenset(names)


@functools.lru_cache(256)
def _neutral(names: frozenset[str], number: int) -> dict[str, AbstractEffect]:
    """The effects of these names; leaves are (`number`,), in numpy."""
    return {name: _repeated(BUILT_IN[name].neutral(), number) for name in names}


def _repeated(effect: AbstractEffect, number: int) -> AbstractEffect:
    return jax.tree.map(lambda leaf: np.full(number, float(leaf)), effect)
