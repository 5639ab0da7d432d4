"""What was asked of a diagnosis: which effects it may name, who is told how far it is, and what is known meanwhile."""

import threading
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from jaxmotor._arguments import check_choice
from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import shown
from jaxmotor.motor.effects import AbstractEffect, check_relations, known_effect, vocabulary
from jaxmotor.prediction import Noise
from jaxmotor.recording import Recording

STAGES = ("linear fit", "effects", "held-out scoring", "open hypotheses", "done")
Asked = str | type[AbstractEffect] | Iterable[str | type[AbstractEffect]]
"""Effects by their names, or classes of one's own; one of them, or several."""


class Progress(NamedTuple):
    """How far a diagnosis is."""

    stage: str
    """For people: what is done now."""
    done: int
    """Stages that are behind."""
    of: int
    """Stages in all."""


class Request:
    """Which effects may be named; what is told of the work, by one thread at a time; and the noise of its readings."""

    def __init__(
        self,
        effects: Asked | None = None,
        exclude: Asked = (),
        on_progress: Callable[[Progress], object] | None = None,
    ):
        """**Raises:** `JaxmotorError` for what is no effect, and where `exclude` leaves none of those asked for."""
        asked, left_out = _each(effects), _each(exclude)
        self.known = {**vocabulary(), **_own(asked)}
        """The effects' classes by name."""
        for effect in _own(asked).values():
            check_relations(effect, self.known)
        chosen = self.known if effects is None else _names(asked, self.known)
        self.effects = frozenset(chosen) - set(_names(left_out, {**self.known, **_own(left_out)}))
        if chosen and not self.effects:
            raise JaxmotorError("no effect is left to look for: exclude names all of them; exclude fewer")
        if on_progress is not None and not callable(on_progress):
            raise JaxmotorError(f"on_progress is {shown(on_progress)}; give a function of a Progress")
        self._on_progress, self._lock = on_progress, threading.Lock()
        self._noises: list[tuple[Recording, bool, Noise]] = []
        self._of_parts: list[tuple[Recording, Noise]] = []
        self.seeks_window = False
        """Motors were simulated whose speeds are means over a window that is sought: programs of those that are over
        none are the same."""

    def asked(self) -> list[type[AbstractEffect]]:
        """The effects that may be named."""
        return [effect for name, effect in self.known.items() if name in self.effects]

    def noise_of(self, recording: Recording, timed: bool) -> Noise | None:
        """Of the readings of `recording`, packed for motors that are `timed` or not, where it has been estimated."""
        part = (noise for one, noise in self._of_parts if one.segments is recording.segments)
        known = (noise for one, packed_so, noise in self._noises if one is recording and packed_so == timed)
        return next(part, next(known, None))

    def keep_noise(self, recording: Recording, timed: bool, noise: Noise) -> None:
        """What `noise_of` shall give: to estimate it takes as long as many fits."""
        if not noise.known and self.noise_of(recording, timed) is None:
            self._noises.append((recording, timed, noise))

    def keep_noise_of_part(self, part: Recording, noise: Noise) -> None:
        """A part of a recording is explained in the noise of the whole, whatever its header states."""
        if not noise.known:
            self._of_parts.append((part, noise))

    def tell(self, stage: int, detail: str = "") -> None:
        """The work is in `STAGES[stage]`, at `detail`."""
        if self._on_progress is not None:
            with self._lock:
                self._on_progress(Progress(STAGES[stage] + detail, stage, len(STAGES) - 1))

    def trying(self, names: tuple[str, ...]) -> None:
        """A motor with the effects `names` is fitted."""
        if names:
            self.tell(1, f": {' + '.join(names)}")


def _each(given: Any) -> tuple[Any, ...]:
    """One, several or none."""
    if given is None or isinstance(given, str | type):
        return () if given is None else (given,)
    return tuple(given) if isinstance(given, Iterable) else (given,)


def _own(asked: tuple[Any, ...]) -> dict[str, type[AbstractEffect]]:
    """The classes in `asked`, by name."""
    own: dict[str, type[AbstractEffect]] = {}
    for effect in map(known_effect, (one for one in asked if not isinstance(one, str))):
        if own.setdefault(effect.name, effect) is not effect:
            raise JaxmotorError(f"two classes have the name {shown(effect.name)}; give each a name of its own")
    return own


def _names(asked: tuple[Any, ...], known: dict[str, type[AbstractEffect]]) -> list[str]:
    names = [one if isinstance(one, str) else one.name for one in asked]
    for name in names:
        check_choice("the effect", name, known)
    return names
