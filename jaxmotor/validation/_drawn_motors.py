"""Draws of motors from the covariance of a model."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Key

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate import KEYS, SHARE, Joint, Model, linear_to_json, names_of
from jaxmotor.motor import Motor, SecondOrder
from jaxmotor.motor.effects import AbstractEffect, parameters

MOST_VISCOUS = 0.95
"""Share of the pole."""


class Known(NamedTuple):
    """Parameters with their values, and a root of their covariance."""

    names: tuple[str, ...]
    values: Float[np.ndarray, " p"]
    relative: Bool[np.ndarray, " p"]
    """Drawn in its logarithm, and `root` is that of the logarithm."""
    root: Float[np.ndarray, "p p"]


def draw_motors(model: Model, number: int, key: Key[Array, ""]) -> Motor:
    """The motor of `model` with its effects, then motors around it, as one whose leaves are (number,).

    They are drawn from `model.joint`; where there is none, each parameter of an effect is drawn by itself. A parameter
    whose error is not known keeps its value, as the rig's voltage offset does.

    **Raises:** `JaxmotorError` where the covariance is none.
    """
    whole, known = model.whole, _known(model)
    fields = ("gain", "pole", *(["electrical_time_constant"] if isinstance(whole.linear, SecondOrder) else []))

    def draw(normal: Float[Array, " p"]) -> Motor:
        moved = jnp.asarray(known.root) @ normal
        row = jnp.where(known.relative, known.values * jnp.exp(moved), known.values + moved)
        drawn = dict(zip(known.names, row, strict=True))
        linear = type(whole.linear)(**{field: drawn[key] for field, key in zip(fields, KEYS, strict=False)})
        effects = tuple(_with(effect, drawn) for effect in whole.effects)
        share = jnp.clip(drawn.get(SHARE, jnp.asarray(whole.viscous_share)), 0.0, MOST_VISCOUS)
        return Motor(linear, effects, share)

    return jax.vmap(draw)(jax.random.normal(key, (number, len(known.names)), known.root.dtype).at[0].set(0.0))


def _with(effect: AbstractEffect, drawn: dict[str, Float[Array, ""]]) -> AbstractEffect:
    own = {name: jnp.asarray(getattr(effect, name)) for name in parameters(effect)}
    return type(effect)(**{name: drawn.get(f"{effect.name}.{name}", value) for name, value in own.items()})


def check_covariance(model: Model) -> None:
    """**Raises:** `JaxmotorError` where motors cannot be drawn from the covariance of `model`."""
    _known(model)


def _known(model: Model) -> Known:
    whole, joint = model.whole, model.joint or _apart(model)
    joint = joint.of([*KEYS[: whole.linear.order + 1], SHARE, *names_of(whole.effects)])
    values = linear_to_json(whole.linear) | {SHARE: float(whole.viscous_share)}
    relative = dict.fromkeys(KEYS, True) | {SHARE: False}
    for effect in whole.effects:
        for name, about in parameters(effect).items():
            values[f"{effect.name}.{name}"] = float(getattr(effect, name))
            relative[f"{effect.name}.{name}"] = about["kind"] == "positive"
    value, is_relative = (np.array([table[name] for name in joint.names]) for table in (values, relative))
    scale = np.where(is_relative & (value != 0), value, 1.0)
    error = np.sqrt(np.maximum(np.diag(joint.covariance), 0.0)) / np.abs(scale)
    # What is hardly known is not drawn from beyond its own size.
    scale = scale * np.where(is_relative, np.maximum(error, 1.0), 1.0)
    size, axes = np.linalg.eigh(joint.covariance / np.outer(scale, scale))
    if size.min() < -1e-6 * len(size) * np.abs(size).max():
        raise JaxmotorError(
            f"{model.source}: covariance is not one (it has a negative variance); write the model anew with identify"
        )
    return Known(joint.names, value, is_relative, axes * np.sqrt(np.maximum(size, 0.0)))


def _apart(model: Model) -> Joint:
    """Every parameter of an effect by itself."""
    keys = KEYS[: len(model.covariance)]
    table = {
        f"{effect.name}.{name}": error
        for effect, errors in zip(model.effects, model.effect_errors, strict=False)
        for name, error in errors.items()
        if np.isfinite(error)
    }
    covariance = np.zeros((len(keys) + len(table),) * 2)
    covariance[: len(keys), : len(keys)] = model.covariance
    covariance[len(keys) :, len(keys) :] = np.diag(np.square(list(table.values())))
    return Joint((*keys, *table), covariance)
