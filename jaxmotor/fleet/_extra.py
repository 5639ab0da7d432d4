"""What only fleets need, imported when it is needed."""

import importlib
from typing import Any

from jaxmotor._errors import JaxmotorError


def needs(module: str) -> Any:
    """`module` of the extra `fleet`. **Raises:** `JaxmotorError` where it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise JaxmotorError(
            f"fleets need the package {package}, which cannot be imported ({error}); "
            "install it with: pip install 'jaxmotor[fleet]'"
        ) from error
