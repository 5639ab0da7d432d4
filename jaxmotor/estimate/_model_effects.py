"""The effects of a model file, each `{"name", "parameters": {...}, "standard_error": {...}}` in terms of `vocabulary`.

Sizes (`positive`, `amplitude`) are not negative, and a parameter is known by its name. A standard error may be missing
or null: not known. Other keys, such as what a diagnosis says of rivals, are left alone.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from jaxmotor._json import plain
from jaxmotor._precision import in_float64, to_numpy
from jaxmotor._sentences import one_of, shown
from jaxmotor.estimate._model_numbers import is_number
from jaxmotor.motor.effects import GROUP, AbstractEffect, AbstractLoadEffect, parameters, vocabulary


class ReadEffect(NamedTuple):
    """An effect and the standard errors of its parameters."""

    effect: AbstractEffect
    standard_error: dict[str, float]


def effects_to_json(
    effects: Sequence[AbstractEffect], errors: Sequence[Mapping[str, float]] = ()
) -> list[dict[str, Any]]:
    """`effects` with the standard `errors` of their parameters as plain objects; an unknown error is None."""
    known = [*errors, *({} for _ in range(len(effects) - len(errors)))]
    return [
        {
            "name": effect.name,
            "parameters": {name: float(getattr(effect, name)) for name in parameters(effect)},
            "standard_error": {name: plain(error.get(name, math.nan)) for name in parameters(effect)},
        }
        for effect, error in zip(effects, known, strict=True)
    ]


@in_float64
def read_effects(content: Any) -> list[ReadEffect]:
    """The effects of a model file's `effects`; none where it is absent.

    **Raises:** `ValueError`, a sentence, where it is something else than a list of effects of the vocabulary.
    """
    if content is None:
        return []
    if not isinstance(content, list) or len(content) > len(vocabulary()):
        raise ValueError("effects is not a list of effects, each once at most")
    read = [_read(item) for item in content]
    names = [each.effect.name for each in read]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"effects names {twice} twice")
    loads = [each.effect.name for each in read if isinstance(each.effect, AbstractLoadEffect)]
    if len(loads) > 1:
        raise ValueError(f"effects has {' and '.join(sorted(loads))}, each with a load; a motor has one")
    return read


def _read(item: Any) -> ReadEffect:
    name = item.get("name") if isinstance(item, dict) else None
    known = vocabulary()
    if not isinstance(name, str) or name not in known:
        raise ValueError(
            f"effects has the name {shown(name)}, which is none of {one_of(sorted(known), name)}; an effect of "
            f"your own is known where it is registered ({GROUP})"
        )
    about = parameters(known[name])
    values, errors = _table(name, item, "parameters"), _table(name, item, "standard_error")
    unknown = next((key for key in values if key not in about), None)
    if unknown is not None:
        raise ValueError(f"effect {name} has no parameter {shown(unknown)}; it has {', '.join(about) or 'none'}")
    numbers = {key: _value(name, key, values.get(key, about[key].get("absent")), about[key]) for key in about}
    effect = to_numpy(known[name].of(**numbers))
    return ReadEffect(effect, {key: _error(name, key, errors.get(key)) for key in about})


def _table(name: str, item: dict[str, Any], key: str) -> dict[str, Any]:
    table = item.get(key)
    if table is not None and not isinstance(table, dict):
        raise ValueError(f"effect {name}: {key} is not a table of numbers")
    return table or {}


def _value(name: str, key: str, value: Any, about: dict[str, Any]) -> float:
    kind, choices = about["kind"], about.get("choices", ())
    if not is_number(value):
        raise ValueError(f"effect {name}: {key} is {shown(value)}, not a number")
    if choices and value not in choices:
        raise ValueError(f"effect {name}: {key} is {value:g}; it is {' or '.join(f'{one:g}' for one in choices)}")
    if value <= 0 and kind == "range":
        raise ValueError(f"effect {name}: {key} is {value:g}; how far a curve reaches, and where it bends, is above 0")
    if value < 0 and kind in ("positive", "amplitude", "fixed"):
        raise ValueError(f"effect {name}: {key} is {value:g}, and is never negative")
    return float(value)


def _error(name: str, key: str, error: Any) -> float:
    if error is None:
        return math.nan
    if not is_number(error) or error < 0:
        raise ValueError(f"effect {name}: the standard error of {key} is {shown(error)}, not a positive number or null")
    return float(error)
