"""Motors as likely as the model's covariance says, and where 95 of 100 of what they do lies."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate import Model
from jaxmotor.motor import SecondOrder
from jaxmotor.validation._validation import Interval

SHARE = 0.95


def psi_of(model: Model) -> np.ndarray:
    """(K, b, log a [, log τ]) with b = K u0, as the trajectory fit has them."""
    motor = model.motor
    gain, pole = float(motor.gain), float(motor.pole)
    psi = [gain, gain * model.offset_V, np.log(pole)]
    return np.array([*psi, np.log(float(motor.electrical_time_constant))] if isinstance(motor, SecondOrder) else psi)


def relative_root(model: Model) -> np.ndarray:
    """(p, p) A with A Aᵀ the covariance of the logarithms of (gain, pole [, time constant]).

    **Raises:** `JaxmotorError` where the covariance is none.
    """
    motor = model.motor
    values = [motor.gain, motor.pole]
    values = np.array([*values, motor.electrical_time_constant] if isinstance(motor, SecondOrder) else values, float)
    relative = model.covariance / np.outer(values, values)
    size, axes = np.linalg.eigh((relative + relative.T) / 2)
    if size.min() < -1e-6 * np.abs(size).max():
        raise JaxmotorError(
            f"{model.source}: covariance is not one (it has a negative variance); write the model anew with identify"
        )
    return axes * np.sqrt(np.maximum(size, 0.0))


def draw_psi(
    psi: Float[Array, " p"], root: Float[Array, "m m"], number: int, key: Key[Array, ""]
) -> Float[Array, "number p"]:
    """`psi`, then motors around it; gain, pole and time constant keep their signs, the offset u0 its value."""
    moved = jax.random.normal(key, (number, root.shape[0]), psi.dtype).at[0].set(0.0) @ root.T
    factor = jnp.exp(moved[:, :1])
    return jnp.concatenate([psi[None, :2] * factor, psi[None, 2:] + moved[:, 1:]], axis=1)


def spread(draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limits (along axis 0) between which one more draw lies with 95 %, however few the draws are."""
    tail = (1 - SHARE) / 2
    low, high = np.quantile(draws, [tail, 1 - tail], axis=0, method="weibull")
    return np.asarray(low), np.asarray(high)


def interval(draws: np.ndarray) -> Interval:
    """Mean and limits of the finite ones among `draws`; NaN where one in ten is not."""
    finite = draws[np.isfinite(draws)]
    if len(finite) < 0.9 * len(draws):
        return Interval(float("nan"), float("nan"), float("nan"))
    low, high = spread(finite)
    return Interval(float(finite.mean()), float(low), float(high))


def alone(value: float) -> Interval:
    """A value without an interval."""
    return Interval(float(value), float("nan"), float("nan"))
