"""A shaft that was seen at rest before the first voltage: no motor explains the log that would have turned there.

Rows of rest are not fitted: they hold one rounding error many times over (`prediction.pieces_of`). But a constant load
or an offset that nothing holds turns the shaft in them. Pushed by p [V] beyond what friction holds, it has over the
time T of the rest the mean speed

    K p (1 - (1 - exp(-a T)) / (a T)),

that of the linear motor's step response.
"""

import math

import jax.numpy as jnp
import numpy as np

from jaxmotor.diagnosis._free import is_possible
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import AbstractDisturbance, AbstractEffect, AbstractLearnedEffect, Rig
from jaxmotor.motor.effects._base import (
    AbstractFrictionEffect,
    AbstractMemoryTorqueEffect,
    AbstractSourceEffect,
    AbstractTorqueEffect,
    AbstractWindingEffect,
    Source,
)
from jaxmotor.recording import Recording, Segment

LEAST_ROWS = 3
"""Rows of rest, at least."""
PLAIN = 3.0
"""Times the slowest speed that the log shows, which nobody overlooks."""
ANGLES = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
"""At which the shaft may rest [rad]."""


def rest_of(recording: Recording) -> tuple[float, float]:
    """How long the shaft is at rest before it is first driven, at longest [s], and the slowest speed that would be seen
    there [rad/s]; zero and infinity where it is not."""
    rests = [(_rest_s(segment), segment) for segment in recording.segments]
    rest_s, _ = max(rests, key=lambda one: one[0])
    if not rest_s:
        return 0.0, math.inf
    is_speed = recording.measured == "speed"
    shafts = [np.asarray(segment.shaft, float)[segment.read] for segment in recording.segments]
    seen = np.abs(np.concatenate(shafts if is_speed else [np.diff(shaft) for shaft in shafts]))
    finest = float(seen[seen > 0].min()) if (seen > 0).any() else math.inf
    if recording.measured == "count":
        assert recording.counts_per_rev is not None
        finest *= 2 * math.pi / recording.counts_per_rev
    return rest_s, finest if is_speed else finest / rest_s


def may_be(motor: Motor, rig: Rig) -> bool:
    """`motor` has effects of sizes that the rig can have, and `may_rest`."""
    return is_possible(motor, rig) and may_rest(motor, rig)


def may_rest(motor: Motor, rig: Rig) -> bool:
    """`motor` would have stayed at rest, as far as the log shows, where that shows the shaft at rest."""
    if not rig.rest_s:
        return True
    push = _push(motor.effects, rig)
    if not push > 0:
        return True
    time_constants = float(motor.linear.pole) * rig.rest_s
    reached = 1 + math.expm1(-time_constants) / time_constants
    return bool(abs(float(motor.linear.gain)) * push * reached <= PLAIN * rig.slowest_rad_s)


def _rest_s(segment: Segment) -> float:
    driven = np.flatnonzero(segment.volts)
    rows = slice(0, int(driven[0]) if len(driven) else 0)
    shaft = np.asarray(segment.shaft, float)[rows][segment.read[rows]]
    still = 0.0 if segment.speed_rad_s is not None else shaft[:1]
    is_rest = segment.at_rest and len(shaft) >= LEAST_ROWS and bool((shaft == still).all())
    return float(np.ptp(segment.time_s[rows])) if is_rest else 0.0


def _push(effects: tuple[AbstractEffect, ...], rig: Rig) -> float:
    """Voltage that pushes the shaft at no input, beyond what friction holds [V]; none where that cannot be told."""
    if any(isinstance(effect, AbstractMemoryTorqueEffect) for effect in effects):
        return 0.0
    zero, angles = jnp.zeros(()), jnp.asarray(ANGLES)
    source = Source(zero, jnp.asarray(rig.supply_V), jnp.ones(()), zero)
    pushed = hold = 0.0
    for effect in effects:
        if isinstance(effect, (AbstractLearnedEffect, AbstractDisturbance)):
            continue
        if isinstance(effect, AbstractSourceEffect):
            source = effect.source(source, zero)
        elif isinstance(effect, AbstractTorqueEffect):
            pushed -= _constant(np.broadcast_to(effect.resists(zero, angles), angles.shape))
        elif isinstance(effect, AbstractFrictionEffect):
            hold += float(np.max(effect.friction(zero, angles, zero)))
    # Some bridges disconnect the motor at no input.
    if not any(isinstance(effect, AbstractWindingEffect) for effect in effects):
        pushed += float(source.volts)
    return abs(pushed) - hold


def _constant(torques: np.ndarray) -> float:
    """What is there at all angles."""
    one_way = (np.sign(torques) == np.sign(torques[0])).all()
    return float(np.sign(torques[0]) * np.abs(torques).min()) if one_way else 0.0
