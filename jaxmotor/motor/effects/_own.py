"""Whether a class that somebody else wrote is an effect that can be simulated and fitted."""

import dataclasses
import inspect
import re
import string
import typing
from collections.abc import Mapping
from typing import Any

from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import one_of, shown
from jaxmotor.motor.effects import _base as base
from jaxmotor.motor.effects._base import AbstractEffect, Kind, parameters
from jaxmotor.motor.effects._log import OF_LOG

PLACES = (base.AbstractDriveEffect, base.AbstractMotionEffect, base.AbstractSensorEffect)
ROLES = (
    *(base.AbstractSourceEffect, base.AbstractDelayEffect, base.AbstractWindingEffect, base.AbstractLagEffect),
    *(base.AbstractTorqueEffect, base.AbstractFrictionEffect, base.AbstractLoadEffect, base.AbstractMemoryEffect),
    *(base.AbstractMemoryTorqueEffect, base.AbstractCountEffect, base.AbstractAngleSensorEffect),
)
RELATIONS = ("beside", "contains", "same_as", "excludes", "relatives")
Effects = Mapping[str, type[AbstractEffect]]


def checked_effect(effect: object, built_in: Effects) -> type[AbstractEffect]:
    """`effect`, a class. **Raises:** `JaxmotorError`, one sentence, that says what it lacks to be an effect."""
    if not (isinstance(effect, type) and issubclass(effect, AbstractEffect)):
        raise JaxmotorError(
            f"{_called(effect)} is no effect: give its name, or a subclass of jaxmotor.motor.effects.AbstractEffect"
        )
    if built_in.get(getattr(effect, "name", "")) is not effect:
        for check in (_check_bases, _check_texts, _check_fields):
            check(effect)
        _check_name(effect, built_in)
    return effect


def _called(effect: object) -> str:
    if isinstance(effect, type):
        return f"the class {effect.__name__}"
    return f"a {type(effect).__name__} object" if isinstance(effect, AbstractEffect) else shown(effect)


def _check_bases(effect: type[AbstractEffect]) -> None:
    for bases, what in ((PLACES, "where it acts"), (ROLES, "how it acts")):
        if not issubclass(effect, bases):
            names = ", ".join(one.__name__ for one in bases)
            raise JaxmotorError(f"{effect.__name__} does not say {what}: it needs a base out of {names}")
    if inspect.isabstract(effect):
        lacking = ", ".join(sorted(effect.__abstractmethods__))
        raise JaxmotorError(f"{effect.__name__} lacks {lacking}: an effect defines its law, and where fits start")


def _check_texts(effect: type[AbstractEffect]) -> None:
    about = {"name": "its name in reports and files", "says": "what it does", "advice": "what to do about it"}
    for attribute, what in about.items():
        if not (isinstance(text := getattr(effect, attribute, None), str) and text):
            raise JaxmotorError(f"{effect.__name__} lacks the attribute {attribute}: {what}, a text")
    for attribute in ("says", "says_negative"):
        where = f"{effect.__name__}.{attribute}"
        try:
            fields = [field for _, field, _, _ in string.Formatter().parse(getattr(effect, attribute))]
        except ValueError:
            raise JaxmotorError(f"{where} has a brace that is never closed or opened") from None
        if unknown := sorted({field for field in fields if field is not None} - set(parameters(effect))):
            raise JaxmotorError(f"{where} has {shown(unknown[0])} in braces, which is none of its parameters")


def _check_name(effect: type[AbstractEffect], built_in: Effects) -> None:
    name = effect.name
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise JaxmotorError(f"{effect.__name__}.name is {shown(name)}; use small letters, digits and underscores")
    if name in built_in or name in [one.name for one in OF_LOG] or name == "none":
        raise JaxmotorError(f"{effect.__name__}.name is {shown(name)}, which jaxmotor has already; choose another one")
    if not isinstance(effect.holds_by, str) or effect.holds_by not in ("", *parameters(effect)):
        raise JaxmotorError(f"{effect.__name__}.holds_by is {shown(effect.holds_by)}, which is none of its parameters")
    if not isinstance(effect.family, str):
        raise JaxmotorError(f"{effect.__name__}.family is {shown(effect.family)}; give a text, such as 'friction'")
    for relation in RELATIONS:
        if not isinstance(names := getattr(effect, relation), tuple):
            raise JaxmotorError(f"{effect.__name__}.{relation} is {shown(names)}; give a tuple of names of effects")
    for near in effect.relatives if set(effect.relatives) <= set(built_in) else ():
        if _units(built_in[near]) != _units(effect):
            raise JaxmotorError(
                f"{effect.__name__}.relatives has {near}, which has not one parameter of the same unit as it"
            )


def _units(effect: type[AbstractEffect]) -> list[str]:
    return [about["unit"] for about in parameters(effect).values()]


def _check_fields(effect: type[AbstractEffect]) -> None:
    about = parameters(effect)
    kinds = typing.get_args(Kind)
    for name in [field.name for field in dataclasses.fields(effect)]:
        if not about.get(name, {}).get("unit"):
            raise JaxmotorError(
                f"{effect.__name__}.{name} has no unit: make it a parameter(unit, kind, neutral=, start=, scale=)"
            )
        if about[name]["kind"] not in kinds:
            raise JaxmotorError(
                f"the kind of {effect.__name__}.{name} is {shown(about[name]['kind'])}; it is one of {one_of(kinds)}"
            )
    for place, (name, own) in enumerate(about.items()):
        below = [other for other, its in list(about.items())[:place] if its["kind"] == "positive"]
        if "least" in own and (own["kind"] != "positive" or own["least"] not in below):
            raise JaxmotorError(
                f"{effect.__name__}.{name} has least={shown(own['least'])}; both must be positive parameters, and that "
                "one stand before it"
            )
    if not _has_phase(about):
        raise JaxmotorError(f"{effect.__name__} has an amplitude; it needs a parameter phase_rad of kind phase, too")


def _has_phase(about: dict[str, dict[str, Any]]) -> bool:
    """As many amplitudes as phases: none, or one of each."""
    of_kind = {kind: [name for name in about if about[name]["kind"] == kind] for kind in ("amplitude", "phase")}
    return of_kind["phase"] == (["phase_rad"] if of_kind["amplitude"] else []) and len(of_kind["amplitude"]) <= 1
