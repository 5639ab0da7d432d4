"""One compiled program for many motors: in it, effects that a motor lacks are there, but neutral.

To compile a program takes as long as to run it a hundred times, and a search fits some fifty combinations of effects.
A neutral effect changes nothing and, where its law is simple, costs little.
"""

import functools
from typing import Any, Literal

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float

from jaxmotor.diagnosis._free import is_wide
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import BUILT_IN, LEARNED, OF_LOG, CoulombFriction, SpeedWindow, Stiction

Sharing = Literal["nothing", "simple", "most"]
"""Which effects motors have in common in the programs of one log: none, in long ones; those of a `program_level`; or,
where the log is short and one sequence, also those that are `cheap_alone`, and all learned curves once there is one."""

BESIDE_CONTACT = frozenset({CoulombFriction.name, Stiction.name})
"""What a gear with backlash has, as a rule. The steps of a contact are many, so motors with one share no more: friction
takes half as long again, whichever it is, and both together no longer than one."""


def as_shared(motors: Motor, sharing: Sharing, window_s: float | None = None) -> Motor:
    """`motors`, whose leaves are (k,), with all effects that share a program with its own, in one order; and where
    speeds are means over `window_s`, with that as if it were sought."""
    if shared_names(motors, sharing) is None:
        return motors
    leaves, tree = shared_leaves(motors, sharing, window_s)
    return jax.tree.unflatten(tree, leaves)


def shared_leaves(
    motors: Motor, sharing: Sharing, window_s: float | None = None
) -> tuple[list[Float[np.ndarray, " k"]], Any]:
    """Leaves and structure of `as_shared`."""
    own, tree = jax.tree.flatten(motors)
    places, shared = _places(tree, sharing, window_s)
    number = len(own[0])
    return [own[leaf] if isinstance(leaf, int) else np.full(number, leaf) for leaf in places], shared


@functools.lru_cache(256)
def _places(tree: Any, sharing: Sharing, window_s: float | None) -> tuple[list[int | float], Any]:
    """Of each leaf of what a motor of the structure `tree` shares its place among the motor's own, or its value; and
    the structure of that."""
    motor = jax.tree.unflatten(tree, range(tree.num_leaves))
    names = shared_names(motor, sharing)
    if names is None:
        return list(range(tree.num_leaves)), tree
    window = {} if window_s is None else {SpeedWindow.name: SpeedWindow.of(length_s=window_s)}
    others = {name: BUILT_IN[name].neutral() for name in names} | window
    every = jax.tree.map(float, others) | {effect.name: effect for effect in motor.effects}
    effects = tuple(every[name] for name in sorted(every))
    return jax.tree.flatten(eqx.tree_at(lambda motor: motor.effects, motor, effects))


def shared_names(motor: Motor, sharing: Sharing) -> frozenset[str] | None:
    """The effects in the program of `motor`, neutral where it lacks them: those up to the highest `program_level` of
    its own. None where it has a program of its own.

    Without effects but the log's that is so: a linear motor needs no steps. With a contact, where no more than `simple`
    effects are shared, they are those of `BESIDE_CONTACT` if it has one of these, else none.
    """
    own = [effect for effect in motor.effects if not isinstance(effect, OF_LOG)]
    if not own or sharing == "nothing":
        return None
    if is_wide(motor.effects) and sharing == "simple":
        return BESIDE_CONTACT if any(effect.name in BESIDE_CONTACT for effect in own) else frozenset()
    level = max((effect.program_level for effect in own if effect.program_level is not None), default=0)
    names = {one.name for one in BUILT_IN.values() if one.program_level is not None and one.program_level <= level}
    if sharing == "most":
        names |= {one.name for one in BUILT_IN.values() if one.cheap_alone}
        names |= LEARNED.keys() if any(effect.name in LEARNED for effect in own) else set()
    return frozenset(names)
