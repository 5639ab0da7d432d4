"""Effects that are locked to the shaft's angle, in a recording that counts it from another zero."""

import dataclasses
import math

import equinox as eqx
import jax
import numpy as np

from jaxmotor._precision import to_jax
from jaxmotor.estimate import Model
from jaxmotor.motor.effects import parameters
from jaxmotor.prediction import Log, pack, shaft_angles
from jaxmotor.recording import Recording
from jaxmotor.validation._free_simulation import simulate_freely, whole_log

TRIED = 8
"""Phases at once."""
ROUNDS = 4
"""The first over the whole circle, each further one between the neighbours of the best."""


def in_place(model: Model, recording: Recording, segments: tuple[int, ...]) -> tuple[Model, list[str]]:
    """`model` with what it has locked to the angle turned to where `segments` of `recording` show it; notes on it.

    Where a recording does not know its angle throughout, such effects are left out.
    """
    locked = [k for k, effect in enumerate(model.effects) if "phase_rad" in parameters(effect)]
    if not locked:
        return model, []
    names = " and ".join(model.effects[k].name for k in locked)
    if shaft_angles(recording) is None:
        note = f"the recording does not show the shaft's angle throughout, which {names} depends on; it is left out"
        return _without(model, locked), [note]
    packed = pack(recording, segments, few_shapes=True)
    log = whole_log(model.whole, recording, packed)
    for again in range(ROUNDS):
        width = math.pi * (2 / TRIED) ** again
        for k in locked:
            model = _turned(model, k, width, log)
    return model, [f"where {names} stands in this recording's angle is fitted to these data: one number each"]


def _turned(model: Model, place: int, width: float, log: Log) -> Model:
    """`model` with the phase of one effect at the best of a few within `width` [rad] of its own."""
    effect = model.effects[place]
    phases = float(effect.phase_rad) + width * (np.arange(TRIED) * 2 / TRIED - 1)  # pyright: ignore[reportAttributeAccessIssue]
    tried = [_phased(model, place, phase) for phase in phases]
    motors = jax.tree.map(lambda *leaves: to_jax(np.stack(leaves)), *(one.whole for one in tried))
    _, off = simulate_freely(motors, log)
    return tried[int(np.argmin((off**2).sum(axis=(1, 2))))]


def _phased(model: Model, place: int, phase: float) -> Model:
    turned = eqx.tree_at(lambda effect: effect.phase_rad, model.effects[place], np.asarray(phase))
    effects = tuple(turned if k == place else one for k, one in enumerate(model.effects))
    return dataclasses.replace(model, effects=effects)


def _without(model: Model, places: list[int]) -> Model:
    effects, errors = (
        tuple(one for k, one in enumerate(every) if k not in places) for every in (model.effects, model.effect_errors)
    )
    return dataclasses.replace(model, effects=effects, effect_errors=errors)
