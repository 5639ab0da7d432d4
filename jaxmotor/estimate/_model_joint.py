"""How sure the parameters of a model with effects are together, as its file has it; the key is optional.

    "joint_covariance": {"names": ["gain_rad_s_V", "pole_rad_s", "coulomb_friction.volts_V"], "covariance": [[...]]}

A parameter of an effect is named effect.parameter. Parameters that are not named are known by themselves, if at all.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from jaxmotor._sentences import shown
from jaxmotor.estimate._model_numbers import covariance_of
from jaxmotor.motor import AbstractEffect
from jaxmotor.motor.effects import parameters


class Joint(NamedTuple):
    """A covariance, in the units of the parameters."""

    names: tuple[str, ...]
    covariance: Float[np.ndarray, "p p"]

    def of(self, names: Sequence[str]) -> "Joint":
        """That of those of `names` which it holds, whatever the others are."""
        kept = [self.names.index(name) for name in names if name in self.names]
        return Joint(tuple(self.names[k] for k in kept), self.covariance[np.ix_(kept, kept)])


def names_of(effects: Sequence[AbstractEffect]) -> list[str]:
    """What the parameters of `effects` are called."""
    return [f"{effect.name}.{parameter}" for effect in effects for parameter in parameters(effect)]


def joint_to_json(joint: Joint) -> dict[str, Any]:
    """`joint` as plain objects."""
    return {"names": list(joint.names), "covariance": joint.covariance.tolist()}


def read_joint(content: Any, needed: Sequence[str], allowed: Sequence[str]) -> Joint | None:
    """What a model file says under `joint_covariance`; None where it says nothing.

    **Raises:** `ValueError`, a sentence, where it is not a covariance of all of `needed` and some of `allowed`.
    """
    if content is None:
        return None
    names, table = (content.get(key) for key in ("names", "covariance")) if isinstance(content, dict) else (None, None)
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or len(names) > 100:
        raise ValueError("joint_covariance has no list of names")
    unknown = next((name for name in names if name not in (*needed, *allowed)), None)
    if unknown is not None:
        raise ValueError(f"joint_covariance names {shown(unknown, 60)}, which is no parameter of this model")
    if len(set(names)) < len(names) or not set(needed) <= set(names):
        raise ValueError(f"joint_covariance does not name {', '.join(needed)} and each other parameter once at most")
    return Joint(tuple(names), covariance_of(table, len(names), "joint_covariance"))
