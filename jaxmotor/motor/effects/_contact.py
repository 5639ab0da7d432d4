"""A load behind a gap: which of two linear motions a step takes, and the push of a contact that begins or ends in it.

In contact both inertias move exactly on the contact's spring, in the gap exactly without it. In a step within which the
contact begins or ends they move as in the gap, with the mean of the push, whose moment is corrected for when it acted.
"""

from typing import NamedTuple

import jax.numpy as jnp

from jaxmotor.motor.effects._base import Load, Scalar
from jaxmotor.motor.effects._propagate import Cells, Matrix, cells


class Contact(NamedTuple):
    """How the load takes part in a step."""

    x: tuple[Scalar, ...]
    """The state, its twist from where the contact's spring is at rest."""
    matrix: Cells
    push: Scalar
    """Mean acceleration of the load [rad/s²], beside that of `matrix`."""
    late: Scalar
    """Mean speed [rad/s] that the load lacks, because the push did not act throughout."""


def contact(
    closed: Matrix, open_: Matrix, load: Load, x: tuple[Scalar, ...], volts: Scalar, torque: Scalar, duration: Scalar
) -> Contact:
    """The step's contact, foreseen with a voltage and a torque [V] that are about right."""
    assert load.gap is not None
    half, twist, n = load.gap / 2, x[-1], len(x)
    stiffness, rub = load.frequency**2, 2 * load.damping * load.frequency

    def foreseen(matrix: Cells, x: tuple[Scalar, ...]) -> tuple[Scalar, Scalar]:
        """Twist and its rate at the end."""
        inputs = (*x, volts, torque)
        end = [sum((matrix[k][j] * value for j, value in enumerate(inputs)), volts * 0) for k in (0, n - 2, n - 1)]
        return end[2], end[0] - end[1]

    side = jnp.sign(twist)
    beyond = twist - side * half
    begin = stiffness * beyond + rub * (x[0] - x[-2])
    touches = (jnp.abs(twist) >= half) & (begin * side > 0)
    rested = (*x[:-1], beyond)
    after, rate = foreseen(cells(closed), rested)
    end = stiffness * after + rub * rate
    stays = touches & (end * side > 0)
    leaves = touches & ~stays
    share_left = begin / jnp.where(leaves, begin - end, 1.0)
    push_left = 0.5 * begin * share_left
    after, rate = foreseen(cells(open_), x)
    over = jnp.abs(after) - half
    arrives = ~touches & (over > 0) & (rate * jnp.sign(after) > 0)
    way = jnp.where(arrives, jnp.abs(after - jnp.clip(twist, -half, half)), 1.0)
    share = jnp.clip(over / way, 0.0, 1.0)
    hit = 0.5 * share * (2 * rub * rate + stiffness * over * jnp.sign(after))
    hit = hit / (1 + 0.5 * share * (rub + 0.5 * stiffness * share * duration) * (1 + load.ratio) * duration)
    # A long step foresees badly; no contact returns more than the energy it was given.
    oscillation = jnp.sqrt(stiffness * (1 + load.ratio)) * jnp.abs(beyond)
    most = 2 * jnp.where(arrives, jnp.abs(rate), jnp.abs(x[0] - x[-2]) + oscillation)
    most = most / ((1 + load.ratio) * jnp.maximum(duration, 1e-12))
    push = jnp.where(arrives, hit, jnp.where(leaves, push_left, 0.0))
    push = jnp.clip(push, -most, most)
    late = push * duration * jnp.where(arrives, 0.5 - 0.4 * share, -(0.5 - share_left / 3))
    matrix = cells(jnp.where(stays, closed, open_))
    return Contact((*x[:-1], jnp.where(stays, beyond, twist)), matrix, push, jnp.where(arrives | leaves, late, 0.0))
