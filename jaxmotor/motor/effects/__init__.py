"""The 22 effects by which a motor differs from a linear one, by name."""

import inspect

from jaxmotor.motor.effects import _drive, _motion, _sensor
from jaxmotor.motor.effects._base import AbstractDriveEffect as AbstractDriveEffect
from jaxmotor.motor.effects._base import AbstractEffect as AbstractEffect
from jaxmotor.motor.effects._base import AbstractMotionEffect as AbstractMotionEffect
from jaxmotor.motor.effects._base import AbstractSensorEffect as AbstractSensorEffect
from jaxmotor.motor.effects._base import Rig as Rig
from jaxmotor.motor.effects._base import free_size as free_size
from jaxmotor.motor.effects._base import from_free as from_free
from jaxmotor.motor.effects._base import parameters as parameters
from jaxmotor.motor.effects._base import to_free as to_free
from jaxmotor.motor.effects._base import values_at as values_at
from jaxmotor.motor.effects._disturbance import DISTURBANCES as DISTURBANCES
from jaxmotor.motor.effects._disturbance import AbstractStepInTime as AbstractStepInTime
from jaxmotor.motor.effects._drive import CoastDrive as CoastDrive
from jaxmotor.motor.effects._drive import CurrentLimit as CurrentLimit
from jaxmotor.motor.effects._drive import DeadZone as DeadZone
from jaxmotor.motor.effects._drive import DirectionAsymmetry as DirectionAsymmetry
from jaxmotor.motor.effects._drive import ElectricalPole as ElectricalPole
from jaxmotor.motor.effects._drive import InputThreshold as InputThreshold
from jaxmotor.motor.effects._drive import SupplyDrift as SupplyDrift
from jaxmotor.motor.effects._drive import SupplySag as SupplySag
from jaxmotor.motor.effects._drive import TransportDelay as TransportDelay
from jaxmotor.motor.effects._drive import VoltageOffset as VoltageOffset
from jaxmotor.motor.effects._drive import VoltageSaturation as VoltageSaturation
from jaxmotor.motor.effects._learned import LEARNED as LEARNED
from jaxmotor.motor.effects._learned import AbstractLearnedEffect as AbstractLearnedEffect
from jaxmotor.motor.effects._log import OF_LOG as OF_LOG
from jaxmotor.motor.effects._log import LogFilter as LogFilter
from jaxmotor.motor.effects._log import TimingOffset as TimingOffset
from jaxmotor.motor.effects._motion import Backlash as Backlash
from jaxmotor.motor.effects._motion import Cogging as Cogging
from jaxmotor.motor.effects._motion import CoulombFriction as CoulombFriction
from jaxmotor.motor.effects._motion import LoadTorque as LoadTorque
from jaxmotor.motor.effects._motion import MeasuredLog as MeasuredLog
from jaxmotor.motor.effects._motion import QuadraticDrag as QuadraticDrag
from jaxmotor.motor.effects._motion import ShaftCompliance as ShaftCompliance
from jaxmotor.motor.effects._motion import Stiction as Stiction
from jaxmotor.motor.effects._motion import WindingHeating as WindingHeating
from jaxmotor.motor.effects._sensor import EncoderEccentricity as EncoderEccentricity
from jaxmotor.motor.effects._sensor import MissedCounts as MissedCounts
from jaxmotor.motor.effects._sensor import SensorLag as SensorLag

EFFECTS: dict[str, type[AbstractEffect]] = {
    member.name: member
    for module in (_drive, _motion, _sensor)
    for member in vars(module).values()
    if isinstance(member, type)
    and issubclass(member, AbstractEffect)
    and member.__module__ == module.__name__
    and not inspect.isabstract(member)
}


def contained_in(name: str) -> tuple[str, ...]:
    """Effects that are special cases of the one called `name`."""
    return EFFECTS[name].contains if name in EFFECTS else ()
