"""An identified motor, to simulate, to validate and to export."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jaxmotor._precision import in_float64, to_jax, to_numpy
from jaxmotor._shown import Row, Shown
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._model_joint import Joint
from jaxmotor.estimate._rows import effect_rows, linear_rows
from jaxmotor.estimate._speed_average import SpeedAverage
from jaxmotor.motor import AbstractEffect, AbstractLinearMotor, Motor
from jaxmotor.motor.effects import VoltageOffset


class ModelRig(NamedTuple):
    """What a motor was identified on, where its recording states it."""

    counts_per_rev: float | None = None
    """Of the encoder, all edges, per turn of the output shaft."""
    supply_V: float | None = None
    """Nominal."""
    duty_full_scale: float | None = None
    """The duty that means the whole supply."""
    duty_delay_s: float | None = None
    """From the moment at which a row was measured to that at which its duty acted."""


UNKNOWN_RIG = ModelRig()


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Model(Shown):
    """An identified motor as a model file holds it."""

    motor: AbstractLinearMotor
    covariance: np.ndarray
    """(p, p) of (gain [rad/s/V], pole [rad/s], electrical time constant [s] if there is one)."""
    offset_V: float
    """Constant voltage error of the rig that it was identified on [V]."""
    period_s: float | None
    recording: str
    """Name of the recording it came from."""
    fitted: frozenset[str]
    """Fingerprints of the segments that were fitted."""
    source: str
    """The model file."""
    effects: tuple[AbstractEffect, ...] = ()
    """What makes it differ from a linear motor."""
    effect_errors: tuple[Mapping[str, float], ...] = ()
    """Standard error of each parameter of each of `effects`, by name; NaN where it is not known."""

    response: FrequencyResponse | None = None
    """What the sines gave, where it came from sines; its leaves are numpy's."""
    viscous_share: float = 0.0
    """Of the pole, `Motor.viscous_share` [1]; only effects on the current make it matter."""
    joint: Joint | None = None
    """How sure the parameters are together, those of `effects` included; None: each by itself."""
    rig: ModelRig = UNKNOWN_RIG
    """Its encoder, supply and duties; exports take these where they are given no others."""
    offset_error_V: float = math.nan
    """Standard error of `offset_V`; NaN where it is not known."""
    average: SpeedAverage | None = None
    """How the speeds of its recording were averaged, where the header does not state it and the data show it."""

    @property
    @in_float64
    def whole(self) -> Motor:
        """Motor, effects and the rig's voltage offset in one, to simulate with `simulate_motor`.

        Its leaves are numpy's, in double precision.
        """
        effects = self.effects
        offset_named = any(effect.name == "voltage_offset" for effect in effects)
        if self.offset_V and not offset_named:
            effects = (*effects, to_numpy(VoltageOffset.of(volts_V=self.offset_V)))
        return to_numpy(Motor(self.motor, effects, to_jax(self.viscous_share)))

    def _title(self) -> str:
        return f"Model of {Path(self.recording).name or 'an unnamed recording'} (± is 95 %)"

    def _rows(self) -> tuple[Row, ...]:
        linear = linear_rows(self.motor, np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist())
        offset = [Row("voltage_offset", self.offset_V, self.offset_error_V, "V")] if self.offset_V else []
        return (*linear, *offset, *effect_rows(self.effects, self.effect_errors))
