"""The motor for python-control: as objects, and as a Python file that builds them.

transfer      G(s), volts to rad/s
state_space   the same with its states
sampled       what a controller meets: u[k], held for a period, to the speed that the count difference shows at tick k,
              every delay included; exact
response      the measured response V(z) as FRD, and the covariance of its real and imaginary parts
covariance    of gain, pole (and electrical time constant)
"""

from typing import Any, NamedTuple

import numpy as np

from jaxmotor._arguments import taken
from jaxmotor._errors import JaxmotorError
from jaxmotor.control import Hardware, hardware_of, linear_numbers, sampled_motor, transfer_function
from jaxmotor.estimate import AnyModel, Model, model_of
from jaxmotor.present.exports._fixed_point import ascii_line, comment
from jaxmotor.present.exports._left_out import left_out

STEP = 1e-6
"""Relative difference over which the response's change with a parameter is taken."""


class ControlMotor(NamedTuple):
    """The motor as python-control's objects."""

    transfer: Any
    """`TransferFunction` G(s) [rad/s/V]."""
    state_space: Any
    """`StateSpace` of G(s)."""
    sampled: Any
    """Discrete `StateSpace`; None where the model has no period."""
    response: Any
    """`FrequencyResponseData`; None where the model comes without one."""
    response_covariance: np.ndarray | None
    """(f, 2, 2) of its real and imaginary parts [(rad/s/V)²]."""
    covariance: np.ndarray
    """(p, p) of (gain, pole [, electrical time constant])."""


def to_control(model: AnyModel, hardware: Hardware | None = None) -> ControlMotor:
    """`model` for python-control; `hardware` gives the period and the duty's delay, else the model's are taken.

    **Raises:** `JaxmotorError` where python-control is not installed.
    """
    model = model_of(model)
    try:
        import control
    except ImportError as error:
        raise JaxmotorError("python-control is not installed; pip install control") from error
    parts = _parts(model, hardware)
    response = parts.get("response")
    return ControlMotor(
        control.tf(parts["numerator"], parts["denominator"]),
        control.ss(*parts["continuous"]),
        None if "sampled" not in parts else control.ss(*parts["sampled"], parts["period_s"]),
        None if response is None else control.frd(response, parts["omega"]),
        parts.get("response_covariance"),
        model.covariance,
    )


def to_python(model: AnyModel, hardware: Hardware | None = None) -> str:
    """A Python file that builds the same objects, by names; it needs numpy and control only."""
    model = model_of(model)
    parts = _parts(model, hardware)
    source = comment(model.recording) or "an unnamed recording"
    lines = [
        '"""A motor, written by jaxmotor export: volts at the bridge to rad/s at the output shaft.',
        "",
        f"From {source.replace(chr(34), chr(39))}.",
        "",
        "transfer     G(s)",
        "state_space  the same with its states",
        "sampled      u[k] to the speed that the count difference shows at tick k; exact, with every delay",
        "response     the measured V(z), mean speed over the tick that holds the voltage",
        '"""',
        "",
        "import control",
        "import numpy as np",
        "",
        *(f"# Not carried: {ascii_line(sentence)}" for sentence in left_out(model, "control")),
        f"gain_rad_s_V, pole_rad_s = {parts['values'][0]!r}, {parts['values'][1]!r}",
        f"covariance = np.array({model.covariance.tolist()!r})  # of gain, pole (and electrical time constant)",
        f"voltage_offset_V = {float(model.offset_V)!r}  # of the rig: add it to every input",
        "",
        f"transfer = control.tf({parts['numerator']!r}, {parts['denominator']!r})",
        _matrices("state_space", parts["continuous"]),
    ]
    if "sampled" in parts:
        lines.append(_matrices("sampled", parts["sampled"], parts["period_s"]))
    if "response" in parts:
        real, imag = np.real(parts["response"]).tolist(), np.imag(parts["response"]).tolist()
        lines += [
            "",
            f"omega = np.array({parts['omega'].tolist()!r})  # rad/s",
            f"response = control.frd(np.array({real!r}) + 1j * np.array({imag!r}), omega)",
            f"# (f, 2, 2) of real and imaginary part\nresponse_covariance = np.array("
            f"{parts['response_covariance'].tolist()!r})",
        ]
    return "\n".join(lines) + "\n"


def _matrices(name: str, matrices: tuple[np.ndarray, ...], period_s: float | None = None) -> str:
    written = ",\n    ".join(f"{np.asarray(matrix).tolist()!r}" for matrix in matrices)
    sampling = "" if period_s is None else f",\n    {period_s!r},  # s"
    return f"{name} = control.ss(\n    {written}{sampling}\n)"


def _parts(model: Model, hardware: Hardware | None) -> dict[str, Any]:
    gain, pole, lag = linear_numbers(model.whole)
    parts: dict[str, Any] = {"values": (gain, pole)}
    parts["numerator"], parts["denominator"] = transfer_function(model.whole)
    if lag:
        a, b = np.array([[0.0, pole], [-1 / lag, -1 / lag]]), np.array([[0.0], [gain / lag]])
        parts["continuous"] = (a, b, np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    else:
        matrices = ([[-pole]], [[gain * pole]], [[1.0]], [[0.0]])
        parts["continuous"] = tuple(np.array(matrix) for matrix in matrices)
    if hardware is not None:
        taken(hardware, Hardware, "a Hardware (of jaxmotor.control)")
    elif model.period_s is not None:
        hardware = hardware_of(model, counts_per_rev=1.0, supply_V=1.0)  # of which voltages to speeds know nothing
    if hardware is not None:
        sampled = sampled_motor(model.whole, hardware)
        matrices = (sampled.transition, sampled.drive[:, None], sampled.output[None, :], np.zeros((1, 1)))
        parts |= {"sampled": matrices, "period_s": hardware.period_s}
    if model.response is not None:
        parts |= {
            "response": np.asarray(model.response.response),
            "omega": 2 * np.pi * np.asarray(model.response.frequency_Hz),
            "response_covariance": np.asarray(model.response.covariance),
        }
    return parts
