"""What was asked of a diagnosis: which effects it may name, and who is told how far it is."""

import threading
from collections.abc import Callable, Iterable
from typing import NamedTuple

from jaxmotor._arguments import check_choice
from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import shown
from jaxmotor.motor.effects import DISTURBANCES, EFFECTS, LEARNED

STAGES = ("linear fit", "effects", "held-out scoring", "what is left open", "done")
VOCABULARY = (*EFFECTS, *LEARNED, *DISTURBANCES)


class Progress(NamedTuple):
    """How far a diagnosis is."""

    stage: str
    """For people: what is done now."""
    done: int
    """Stages that are behind."""
    of: int
    """Stages in all."""


class Request:
    """Which effects may be named; and what is told of the work, by one thread at a time."""

    def __init__(
        self,
        effects: Iterable[str] | None = None,
        exclude: Iterable[str] = (),
        on_progress: Callable[[Progress], object] | None = None,
    ):
        """**Raises:** `JaxmotorError` for a name that is no effect."""
        chosen, left_out = (_names(names) for names in (effects, exclude))
        self.effects = frozenset(VOCABULARY if effects is None else chosen) - set(left_out)
        if on_progress is not None and not callable(on_progress):
            raise JaxmotorError(f"on_progress is {shown(on_progress)}; give a function of a Progress")
        self._on_progress, self._lock = on_progress, threading.Lock()

    def tell(self, stage: int, detail: str = "") -> None:
        """The work is in `STAGES[stage]`, at `detail`."""
        if self._on_progress is not None:
            with self._lock:
                self._on_progress(Progress(STAGES[stage] + detail, stage, len(STAGES) - 1))

    def trying(self, names: tuple[str, ...]) -> None:
        """A motor with the effects `names` is fitted."""
        if names:
            self.tell(1, f": {' + '.join(names)}")


def _names(names: Iterable[str] | None) -> tuple[str, ...]:
    names = (names,) if isinstance(names, str) else tuple(names or ())
    for name in names:
        check_choice("the effect", name, VOCABULARY)
    return names
