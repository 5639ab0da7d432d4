"""The effects that are known by name: those of this package, and those that installed packages register.

A package registers a class of its own as an entry point:

    [project.entry-points."jaxmotor.effects"]
    eddy_current_brake = "my_package:EddyCurrentBrake"
"""

import functools
import inspect
from collections.abc import Mapping
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import Any

from jaxmotor._arguments import check_choice
from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import shown
from jaxmotor.motor.effects import _drive, _motion, _rare, _sensor
from jaxmotor.motor.effects._base import AbstractEffect
from jaxmotor.motor.effects._disturbance import DISTURBANCES
from jaxmotor.motor.effects._learned import LEARNED
from jaxmotor.motor.effects._log import OF_LOG
from jaxmotor.motor.effects._own import RELATIONS, checked_effect

GROUP = "jaxmotor.effects"
EFFECTS: dict[str, type[AbstractEffect]] = {
    member.name: member
    for module in (_drive, _motion, _sensor, _rare)
    for member in vars(module).values()
    if isinstance(member, type)
    and issubclass(member, AbstractEffect)
    and member.__module__ == module.__name__
    and not inspect.isabstract(member)
}


BUILT_IN = MappingProxyType(EFFECTS | LEARNED | DISTURBANCES)


@functools.cache
def vocabulary() -> Mapping[str, type[AbstractEffect]]:
    """All effects by name: `EFFECTS`, learned laws and disturbances, then those that packages register, which are
    imported when this is first called.

    **Raises:** `JaxmotorError`, one sentence, for a package's effect that cannot be imported or that is none.
    """
    known = dict(BUILT_IN)
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        effect = _loaded(point)
        if known.setdefault(effect.name, effect) is not effect:
            raise JaxmotorError(f"{_told(point)}: another package has an effect {shown(effect.name)}; uninstall one")
    return MappingProxyType(known)


def known_effect(effect: object) -> type[AbstractEffect]:
    """`effect` where it is a class that can be simulated and fitted.

    **Raises:** `JaxmotorError`, one sentence, that says what it lacks.
    """
    return checked_effect(effect, BUILT_IN)


def check_relations(effect: type[AbstractEffect], known: Mapping[str, type[AbstractEffect]]) -> None:
    """**Raises:** `JaxmotorError` where `effect` says something of an effect that nobody knows."""
    names = (*known, *(one.name for one in OF_LOG))
    for relation in RELATIONS:
        for name in getattr(effect, relation):
            check_choice(f"an effect in {effect.__name__}.{relation}", name, names)


def _loaded(point: Any) -> type[AbstractEffect]:
    """The class that the entry `point` (`importlib.metadata.EntryPoint`, or a backport's) names."""
    try:
        found = point.load()
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
        raise JaxmotorError(f"{_told(point)} cannot be imported ({why}); repair that package or uninstall it") from None
    try:
        return known_effect(found)
    except JaxmotorError as error:
        raise JaxmotorError(f"{_told(point)}: {error}") from None


def _told(point: Any) -> str:
    package = "" if point.dist is None else f" of the package {point.dist.name}"
    return f"the effect {point.value}{package}"
