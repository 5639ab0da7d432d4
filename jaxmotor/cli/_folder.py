"""The folder that `-o` names."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from jaxmotor._errors import JaxmotorError


def make_folder(folder: Path) -> None:
    """Make `folder` and those above it. **Raises:** `JaxmotorError` where that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JaxmotorError(f"{folder}: cannot be made ({error.strerror}); choose another folder") from error


@contextlib.contextmanager
def made_folder(folder: Path | None) -> Iterator[None]:
    """Make `folder`, if any; of what was made, what is empty at the end is removed, also after Ctrl-C.

    **Raises:** `JaxmotorError` where that is not possible.
    """
    new = [] if folder is None else [one for one in (folder, *folder.parents) if not one.exists()]
    if folder is not None:
        make_folder(folder)
    try:
        yield
    finally:
        for one in new:
            with contextlib.suppress(OSError):
                one.rmdir()


def check_free(output: Path, force: bool) -> None:
    """**Raises:** `JaxmotorError` where `output` exists and is not to be replaced by `force`."""
    if output.exists() and not force:
        raise JaxmotorError(f"{output}: exists already; choose another name, or replace it with --force")


def check_names(recordings: list[Path]) -> None:
    """**Raises:** `JaxmotorError` where two recordings have one name, after which their results are named."""
    stems = [path.stem for path in recordings]
    twice = next((stem for stem in stems if stems.count(stem) > 1), None)
    if twice is not None:
        raise JaxmotorError(f"two recordings are called {twice}: their results would overwrite each other; rename one")
