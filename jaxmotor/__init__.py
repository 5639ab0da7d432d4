"""Differentiable system identification of DC motors from voltage and encoder counts.

import jaxmotor as jm
recording = jm.read("m1.csv")
fit = jm.identify(recording)
fit.motor.gain, fit.motor.pole
"""

import importlib
import importlib.metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxmotor._errors import JaxmotorError as JaxmotorError
    from jaxmotor._runtime import keep_programs as keep_programs
    from jaxmotor.diagnosis import Diagnosis as Diagnosis
    from jaxmotor.diagnosis import Progress as Progress
    from jaxmotor.diagnosis import diagnose as diagnose
    from jaxmotor.estimate import Fit as Fit
    from jaxmotor.estimate import FrequencyResponse as FrequencyResponse
    from jaxmotor.estimate import Model as Model
    from jaxmotor.estimate import fit_response as fit_response
    from jaxmotor.estimate import identify as identify
    from jaxmotor.estimate import read_model as read_model
    from jaxmotor.motor import EFFECTS as EFFECTS
    from jaxmotor.motor import FirstOrder as FirstOrder
    from jaxmotor.motor import Motor as Motor
    from jaxmotor.motor import SecondOrder as SecondOrder
    from jaxmotor.present.exports import to_control as to_control
    from jaxmotor.present.exports import to_export_json as to_export_json
    from jaxmotor.present.exports import to_mujoco as to_mujoco
    from jaxmotor.present.exports import to_python as to_python
    from jaxmotor.present.exports import to_spice as to_spice
    from jaxmotor.present.exports import to_wpilib as to_wpilib
    from jaxmotor.recording import Recording as Recording
    from jaxmotor.recording import Segment as Segment
    from jaxmotor.recording import check as check
    from jaxmotor.recording import from_arrays as from_arrays
    from jaxmotor.recording import from_dataframe as from_dataframe
    from jaxmotor.recording import import_log as import_log
    from jaxmotor.recording import import_steady as import_steady
    from jaxmotor.recording import import_sysid as import_sysid
    from jaxmotor.recording import join as join
    from jaxmotor.recording import read as read
    from jaxmotor.recording import write as write
    from jaxmotor.validation import Validation as Validation
    from jaxmotor.validation import validate as validate

# Reading a recording should not wait for JAX: names are fetched from their folder when they are asked for.
_HOME = {
    "JaxmotorError": "_errors",
    "keep_programs": "_runtime",
    **dict.fromkeys(
        (
            *("Recording", "Segment", "check", "from_arrays", "from_dataframe"),
            *("import_log", "import_steady", "import_sysid", "join", "read", "write"),
        ),
        "recording",
    ),
    **dict.fromkeys(("EFFECTS", "FirstOrder", "Motor", "SecondOrder"), "motor"),
    **dict.fromkeys(("Fit", "FrequencyResponse", "Model", "fit_response", "identify", "read_model"), "estimate"),
    **dict.fromkeys(("Validation", "validate"), "validation"),
    **dict.fromkeys(("Diagnosis", "Progress", "diagnose"), "diagnosis"),
    **dict.fromkeys(
        ("to_control", "to_export_json", "to_mujoco", "to_python", "to_spice", "to_wpilib"), "present.exports"
    ),
}

__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]
__version__ = importlib.metadata.version("jaxmotor")


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'jaxmotor' has no attribute {name!r}")
    return getattr(importlib.import_module(f"jaxmotor.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*_HOME, "__version__"]
