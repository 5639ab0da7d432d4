"""One compiled program for many motors: in it, effects that a motor lacks are there, but neutral.

To compile a program takes as long as to run it a hundred times, and a search fits some fifty combinations of effects.
A neutral effect changes nothing and, where its law is simple, costs little.
"""

import functools

import equinox as eqx
import jax
import numpy as np

from jaxmotor.diagnosis._free import is_wide
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import BUILT_IN, OF_LOG, AbstractEffect, SpeedWindow


def as_shared(motors: Motor, window_s: float | None = None) -> Motor:
    """`motors`, whose leaves are (k,), with all effects up to the highest `program_level` of its own, in one order; and
    where speeds are means over `window_s`, with that as if it were sought.

    Without effects but the log's it stays as it is: a linear motor needs no steps. So does one with a contact, whose
    steps are many.
    """
    own = {effect.name: effect for effect in motors.effects}
    level = shared_level(motors)
    if level is None:
        return motors
    number = len(np.asarray(motors.linear.gain))
    window = [] if window_s is None else [SpeedWindow.of(length_s=window_s)]
    every = _neutral(level, number) | {one.name: _repeated(one, number) for one in window} | own
    return eqx.tree_at(lambda motor: motor.effects, motors, tuple(every[name] for name in sorted(every)))


def shared_level(motor: Motor) -> int | None:
    """Effects of up to this `program_level` are in the program of `motor`, neutral where it lacks them; None where it
    has one of its own."""
    levels = [effect.program_level for effect in motor.effects if not isinstance(effect, OF_LOG)]
    if not levels or is_wide(motor.effects):
        return None
    return max((level for level in levels if level is not None), default=0)


@functools.lru_cache(256)
def _neutral(level: int, number: int) -> dict[str, AbstractEffect]:
    """The effects that programs of this level have; leaves are (`number`,), in numpy."""
    shared = [one for one in BUILT_IN.values() if one.program_level is not None and one.program_level <= level]
    return {one.name: _repeated(one.neutral(), number) for one in shared}


def _repeated(effect: AbstractEffect, number: int) -> AbstractEffect:
    return jax.tree.map(lambda leaf: np.full(number, float(leaf)), effect)
