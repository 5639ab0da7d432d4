"""Logs of WPILib SysId: the JSON of the older tools, and a CSV exported from a robot's data log.

The JSON holds up to four tests (slow or fast, forward or backward), each a list of rows. In SysId's it is time [s],
volts, position, velocity, and for drivetrains time, volts, position and velocity of left and right in turns, then gyro
angle and rate; in frc-characterization's ten columns come in another order. Positions are turns of the output whatever
`units` says, since the tool multiplies them by `unitsPerRotation` when it reads the file. It also gives each voltage
the sign of the velocity beside it, so the signs in the file mean nothing to it. Here a test keeps its signs, unless the
whole test has voltage against velocity: then all of its voltages are turned, and the parameter `voltage_sign` says so.

The position is preferred to the velocity, since the latter is usually filtered. Where it never moves, or is not
logged, it is the velocity.
"""

import json
import os
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from jaxmotor._arguments import check_text, path_of
from jaxmotor.recording._log import assemble
from jaxmotor.recording._log_columns import Inputs, Log
from jaxmotor.recording._own_words import in_own_words
from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._sysid_csv import STATES, import_sysid_csv
from jaxmotor.recording._text import limit_rows, load, text_of

MAX_JSON = 60_000_000
"""Larger JSON is refused unread [byte]."""
TESTS = {
    "slow-forward": "quasistatic-forward",
    "slow-backward": "quasistatic-reverse",
    "fast-forward": "dynamic-forward",
    "fast-backward": "dynamic-reverse",
}
"""Keys of the JSON, with the test's later name."""
_SIMPLE = (1, 2, 3)
_DRIVETRAIN = {"left": (1, 3, 5), "right": (2, 4, 6)}
_OLDEST = {"left": (3, 5, 7), "right": (4, 6, 8)}


@in_own_words
def import_sysid(
    path: str | os.PathLike[str],
    *,
    units: str | None = None,
    motor: str | None = None,
    wheel_radius_m: float | int | None = None,
) -> Recording:
    """The recording in a SysId JSON or in a CSV exported from a data log.

    For CSV, `units` states those of position and velocity (`rotations`, `radians`, `degrees`, `meters`, `feet`,
    `inches`; lengths need `wheel_radius_m`). `motor` chooses among several: `left` or `right` of a drivetrain's JSON,
    the name in the columns of a CSV. Quasistatic tests become segments of kind `ramp`, dynamic ones `step`, in order
    of time, with the test's name as the parameter `label`.

    **Raises:** `RecordingError`.
    """
    path = path_of(path, "the path of a SysId log")
    for option, text in (("--units", units), ("--motor", motor)):
        if text is not None:
            check_text(option, text)
    if path.suffix.lower() != ".json":
        return import_sysid_csv(path, units=units, motor=motor, wheel_radius_m=wheel_radius_m)
    source = str(path)
    if units is not None:
        raise RecordingError(f"{source}: a SysId JSON holds turns by definition; leave --units out")
    values = _json_object(text_of(load(path, limit=MAX_JSON), source), source)
    columns = _layout(values, motor, source)
    tests = {name: _rows(values[key], columns, key, source) for key, name in TESTS.items() if values.get(key)}
    if not tests:
        raise RecordingError(f"{source}: none of the tests {', '.join(TESTS)} has rows; this is no SysId log")
    limit_rows(sum(map(len, tests.values())), source)
    return _assemble(tests, _about(values, path), source)


def _json_object(text: str, source: str) -> dict[str, Any]:
    try:
        values = json.loads(text, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise RecordingError(f"{source}, line {error.lineno}: not JSON ({error.msg}); save the log again") from error
    except ValueError as error:
        raise RecordingError(f"{source}: a value is no finite number ({error}); save the log again") from error
    except RecursionError:
        raise RecordingError(f"{source}: the JSON is nested too deep for a SysId log; save the log again") from None
    if not isinstance(values, dict) or not set(TESTS) & set(values):
        raise RecordingError(f"{source}: no SysId log, which has the keys {', '.join(TESTS)}; give the tool's JSON")
    return values


def _no_constant(name: str) -> NoReturn:
    raise ValueError(name)


def _layout(values: dict[str, Any], motor: str | None, source: str) -> tuple[int, tuple[int, int, int]]:
    """Columns per row, and those of volts, position and velocity."""
    drivetrain = str(values.get("test", "")).startswith("Drivetrain")
    if values.get("test") == "Drivetrain (Angular)":
        raise RecordingError(f"{source}: a test that turned the robot on the spot is no motor test; give another log")
    if drivetrain and motor not in _DRIVETRAIN:
        raise RecordingError(f"{source}: a drivetrain has two sides; choose --motor left or --motor right")
    if not drivetrain and motor is not None:
        raise RecordingError(f"{source}: the log has one motor only; leave --motor out")
    if "sysid" not in values:
        return 10, _OLDEST[motor or "left"]
    return (9, _DRIVETRAIN[motor]) if motor is not None else (4, _SIMPLE)


def _rows(rows: Any, layout: tuple[int, tuple[int, int, int]], key: str, source: str) -> np.ndarray:
    """(n, 4) time [s], volts, position [turn], velocity [turn/s]."""
    width, columns = layout
    if not isinstance(rows, list):
        raise RecordingError(f"{source}: the test {key!r} is not a list of rows; save the log again")
    for number, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != width or not all(type(cell) in (int, float) for cell in row):
            raise RecordingError(f"{source}: row {number} of {key!r} is not {width} numbers; save the log again")
    try:
        table = np.array(rows, dtype=np.float64)[:, [0, *columns]]
    except OverflowError as error:
        raise RecordingError(
            f"{source}: the test {key!r} has a number beyond all bounds; save the log again"
        ) from error
    if not (np.abs(table) < 1e9).all():
        raise RecordingError(f"{source}: the test {key!r} has a number beyond 1e9; save the log again")
    late = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if len(late):
        raise RecordingError(f"{source}: the time does not run on at row {late[0] + 1} of {key!r}; delete that row")
    return table


def _assemble(tests: dict[str, np.ndarray], about: dict[str, Any], source: str) -> Recording:
    names = sorted(tests, key=lambda name: float(tests[name][0, 0]))
    turned = {name: float(tests[name][:, 1] @ tests[name][:, 3]) < 0 for name in names}
    volts = [tests[name][:, 1] * (-1.0 if turned[name] else 1.0) for name in names]
    table = np.concatenate([tests[name] for name in names])
    moved = any(np.ptp(tests[name][:, 2]) > 0 for name in names)
    column, shaft = ("angle_rad", table[:, 2]) if moved else ("speed_rad_s", table[:, 3])
    return assemble(
        Log((table[:, 0], 0.0), Inputs(np.concatenate(volts)), {column: 2 * np.pi * shaft}),
        np.cumsum([0, *(len(tests[name]) for name in names)]),
        [{"label": name} | ({"voltage_sign": "turned"} if turned[name] else {}) for name in names],
        [STATES[name] for name in names],
        source=source,
        header={"imported": about},
    )


def _about(values: dict[str, Any], path: Path) -> dict[str, Any]:
    kept = {
        key: values[key] for key in ("test", "units", "unitsPerRotation") if type(values.get(key)) in (str, int, float)
    }
    return {"log": path.name, "from": "sysid"} | kept
