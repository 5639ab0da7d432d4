"""What a report is made of."""

import dataclasses
import hashlib
from collections.abc import Callable
from pathlib import Path

from jaxmotor._errors import JaxmotorError
from jaxmotor.diagnosis import Diagnosis, Progress, diagnose
from jaxmotor.estimate import identify
from jaxmotor.recording import Recording
from jaxmotor.validation import Validation, validate


@dataclasses.dataclass(frozen=True, eq=False)
class Story:
    """A recording and everything that was found out from it."""

    recording: Recording
    diagnosis: Diagnosis
    validation: Validation | None
    """Of a linear motor fitted without later steps and without closed loops; None where there are none."""
    not_validated: str
    """Why `validation` is None; empty where it is not."""
    seed: int


def story(
    recording: Recording,
    *,
    seed: int = 0,
    diagnosis: Diagnosis | None = None,
    on_progress: Callable[[Progress], object] | None = None,
) -> Story:
    """Diagnose `recording`, and validate its linear motor on half of the steps and on the closed loops.

    A `diagnosis` that was made of it with this `seed` is taken as it is.

    **Raises:** `JaxmotorError`, one sentence, where the recording does not determine a linear motor.
    """
    if diagnosis is None:
        diagnosis = diagnose(recording, seed=seed, on_progress=on_progress)
    held_out = held_out_runs(recording)
    if not held_out:
        return Story(recording, diagnosis, None, "the recording has neither two steps nor a closed loop", seed)
    if on_progress is not None:
        on_progress(Progress("validation", 1, 1))
    try:
        fit = identify(recording, hold_out=held_out, seed=seed)
        return Story(recording, diagnosis, validate(fit, recording, seed=seed), "", seed)
    except JaxmotorError as error:
        return Story(recording, diagnosis, None, str(error), seed)


def digest(source: Path) -> str:
    """SHA-256 of the file, in hex. **Raises:** `JaxmotorError` where it cannot be read."""
    try:
        with source.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise JaxmotorError(f"{source}: cannot be read ({error.strerror})") from error


def held_out_runs(recording: Recording) -> list[int]:
    """Half of the steps where there are several, and the loops: what a linear motor is then held against."""
    kinds = [segment.kind for segment in recording.segments]
    steps = [index for index, kind in enumerate(kinds) if kind == "step"]
    loops = [index for index, kind in enumerate(kinds) if kind == "closed_loop"]
    return [*(steps[len(steps) // 2 :] if len(steps) > 1 else []), *loops]
