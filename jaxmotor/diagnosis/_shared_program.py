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
from jaxmotor.motor.effects import BUILT_IN, OF_LOG, AbstractEffect


def as_shared(motors: Motor) -> Motor:
    """`motors`, whose leaves are (k,), with all effects up to the highest `program_level` of its own, in one order.

    Without effects but the log's it stays as it is: a linear motor needs no steps. So does one with a contact, whose
    steps are many.
    """
    own = {effect.name: effect for effect in motors.effects}
    levels = [effect.program_level for effect in motors.effects if not isinstance(effect, OF_LOG)]
    if not levels or is_wide(motors.effects):
        return motors
    level = max((level for level in levels if level is not None), default=0)
    every = _neutral(level, len(np.asarray(motors.linear.gain))) | own
    return eqx.tree_at(lambda motor: motor.effects, motors, tuple(every[name] for name in sorted(every)))


@functools.lru_cache(256)
def _neutral(level: int, number: int) -> dict[str, AbstractEffect]:
    """The effects that programs of this level have; leaves are (`number`,), in numpy."""
    shared = [one for one in BUILT_IN.values() if one.program_level is not None and one.program_level <= level]
    return {one.name: jax.tree.map(lambda leaf: np.full(number, float(leaf)), one.neutral()) for one in shared}
