"""The folder that `-o` names."""

from pathlib import Path

from jaxmotor._errors import JaxmotorError


def make_folder(folder: Path) -> None:
    """Make `folder` and those above it. **Raises:** `JaxmotorError` where that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JaxmotorError(f"{folder}: cannot be made ({error.strerror}); choose another folder") from error
