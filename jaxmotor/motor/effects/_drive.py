"""Effects between the command and the winding: bridge, supply, current."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from jaxmotor.motor.effects._base import (
    INFINITE,
    AbstractDelayEffect,
    AbstractDriveEffect,
    AbstractLagEffect,
    AbstractSourceEffect,
    AbstractWindingEffect,
    Scalar,
    Source,
    Winding,
    parameter,
)


class TransportDelay(AbstractDriveEffect, AbstractDelayEffect):
    """u(t - d): the voltage acts late, by any fraction of a tick."""

    name: ClassVar[str] = "transport_delay"
    delay_s: Scalar = parameter("s", "positive", neutral=0.0, start=4e-3, scale=4e-3)
    """d [s]."""

    def delay(self) -> Scalar:
        return self.delay_s


class SupplyDrift(AbstractDriveEffect, AbstractSourceEffect):
    """Vs (1 - r t): the supply falls over the recording."""

    name: ClassVar[str] = "supply_drift"
    stage: ClassVar[int] = 1
    rate_per_s: Scalar = parameter("1/s", "signed", neutral=0.0, start=1e-3, scale=1e-3)
    """r [1/s]."""

    def source(self, source: Source, time: Scalar) -> Source:
        return source._replace(supply=source.supply * (1 - self.rate_per_s * time))


class DeadZone(AbstractDriveEffect, AbstractSourceEffect):
    """sgn(u) max(|u| - d, 0): the first volts are lost."""

    name: ClassVar[str] = "dead_zone"
    stage: ClassVar[int] = 2
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """d [V]."""

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        mean = source.mean
        return source.told(jnp.sign(mean) * jax.nn.relu(jnp.abs(mean) - self.volts_V))


class InputThreshold(AbstractDriveEffect, AbstractSourceEffect):
    """u where |u| >= d, else 0: small voltages do nothing, larger ones are complete."""

    name: ClassVar[str] = "input_threshold"
    stage: ClassVar[int] = 3
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """d [V]."""

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        mean = source.mean
        return source.told(jnp.where(jnp.abs(mean) < self.volts_V, 0.0, mean))


class VoltageSaturation(AbstractDriveEffect, AbstractSourceEffect):
    """u within +-Vmax: the bridge gives no more."""

    name: ClassVar[str] = "voltage_saturation"
    stage: ClassVar[int] = 4
    volts_V: Scalar = parameter("V", "positive", neutral=INFINITE, start=6.0, scale=1.0)
    """Vmax [V]."""

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source.told(jnp.clip(source.mean, -self.volts_V, self.volts_V))


class DirectionAsymmetry(AbstractDriveEffect, AbstractSourceEffect):
    """(1 + e sgn(u)) u: one direction gets more voltage than the other."""

    name: ClassVar[str] = "direction_asymmetry"
    stage: ClassVar[int] = 5
    ratio: Scalar = parameter("1", "signed", neutral=0.0, start=0.03, scale=0.03)
    """e [1]."""

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source._replace(factor=source.factor * (1 + self.ratio * jnp.sign(source.duty)))


class VoltageOffset(AbstractDriveEffect, AbstractSourceEffect):
    """u + u0: a constant voltage in series with the winding."""

    name: ClassVar[str] = "voltage_offset"
    stage: ClassVar[int] = 6
    volts_V: Scalar = parameter("V", "signed", neutral=0.0, start=0.1, scale=0.1)
    """u0 [V]."""

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source._replace(offset=source.offset + self.volts_V)


class CoastDrive(AbstractDriveEffect, AbstractWindingEffect):
    """q = |D| (sgn(D) Vs - back-EMF), never against D: the winding is connected for the share |D| only.

    While the duty D is constant this is a linear motor whose pole shrinks with |D|; at D = 0 there is no current.
    """

    name: ClassVar[str] = "coast_drive"
    lagless: ClassVar[bool] = True

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del memory
        volts = jnp.sign(source.duty) * source.supply * source.factor + source.offset
        return winding._replace(volts=volts, share=jnp.abs(source.duty), way=jnp.ones_like(volts))


class SupplySag(AbstractDriveEffect, AbstractWindingEffect):
    """D (Vs - Rs |D i|): the supply's resistance adds Rs D² to the winding's, and takes it back while braking."""

    name: ClassVar[str] = "supply_sag"
    stage: ClassVar[int] = 1
    ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.2, scale=0.15)
    """Rs/R [1]."""

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del memory
        return winding.more_resistance(self.ratio * source.duty**2 * winding.way)


class CurrentLimit(AbstractDriveEffect, AbstractWindingEffect):
    """|i| R <= v: the driver gives no more current."""

    name: ClassVar[str] = "current_limit"
    stage: ClassVar[int] = 3
    volts_V: Scalar = parameter("V", "positive", neutral=INFINITE, start=5.0, scale=2.0)
    """v = Imax R [V]."""

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del source, memory
        limit = self.volts_V if winding.limit is None else jnp.minimum(winding.limit, self.volts_V)
        return winding._replace(limit=limit)


class ElectricalPole(AbstractDriveEffect, AbstractLagEffect):
    """L/R i' = u/R - i - back-EMF/R: the current, and so the torque, lags."""

    name: ClassVar[str] = "electrical_pole"
    time_constant_s: Scalar = parameter("s", "positive", neutral=0.0, start=3e-3, scale=2e-3)
    """L/R [s], in addition to the linear motor's."""

    def lag(self) -> Scalar:
        return self.time_constant_s
