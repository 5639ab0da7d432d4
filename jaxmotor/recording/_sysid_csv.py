"""A CSV exported from a robot's data log, with the channels of SysId's routine.

The channels are `voltage-<motor>-<mechanism>`, `position-...`, `velocity-...` and `sysid-test-state-<mechanism>`,
whatever stands before them up to a slash. An empty cell holds what was there before. The channels of one round of the
robot's loop arrive a few microseconds apart: rows within a millisecond are one row, at the first one's time and with
the last values. Rows without a test (state `none`) are left out, and so are those in which the shaft was not logged.
"""

import re
from pathlib import Path

import numpy as np

from jaxmotor.recording._log import assemble
from jaxmotor.recording._log_columns import Inputs, Log
from jaxmotor.recording._read_table import read_table
from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._units import Scale, angle_factor, positive

ROUND_S = 1e-3
"""Rows less than this apart belong to one round of the robot's loop [s]."""
STATES = {
    "quasistatic-forward": "ramp",
    "quasistatic-reverse": "ramp",
    "dynamic-forward": "step",
    "dynamic-reverse": "step",
}
"""Names of the tests, with the kind of segment."""
UNITS = {"rotations": "rev", "radians": "rad", "degrees": "deg", "meters": "m", "feet": "ft", "inches": "in"}
_CHANNEL = re.compile(r"(?:.*[/:])?(voltage|position|velocity)-(.+)")
_STATE = re.compile(r"(?:.*[/:])?sysid-test-state(?:-.*)?")
_TIME = re.compile(r"timestamp( ?\(s\))?", re.IGNORECASE)


def import_sysid_csv(
    path: Path, *, units: str | None = None, motor: str | None = None, wheel_radius_m: float | int | None = None
) -> Recording:
    """The recording in the CSV at `path`; the arguments are those of `import_sysid`.

    **Raises:** `RecordingError`.
    """
    source = str(path)
    factor = _factor(units, wheel_radius_m, source)
    table = read_table(path)
    time, state = _one(table, _TIME, "Timestamp"), _one(table, _STATE, "sysid-test-state-...")
    channels = _channels(table, motor)
    shaft = "position" if "position" in channels else "velocity"
    rounds = _rounds(table, time, state, channels["voltage"], channels[shaft])
    if not rounds:
        raise RecordingError(f"{source}: no row belongs to a test; the states are {', '.join(STATES)}")
    runs, labels, *columns = zip(*rounds, strict=True)
    starts = [0, *(row for row in range(1, len(runs)) if runs[row] != runs[row - 1])]
    when, voltages, values = map(np.array, columns)
    return assemble(
        Log(
            (when, table.resolution(time)),
            Inputs(voltages),
            {"angle_rad" if shaft == "position" else "speed_rad_s": values * factor},
        ),
        np.array([*starts, len(labels)]),
        [{"label": labels[row]} for row in starts],
        [STATES[labels[row]] for row in starts],
        source=source,
        header={"imported": {"log": path.name, "from": "sysid", "units": units, "channel": channels[shaft]}},
    )


def _factor(units: str | None, wheel_radius_m: float | int | None, source: str) -> float:
    if units not in UNITS:
        stated = "states no units" if units is None else f"has units {units!r}, which are not known"
        raise RecordingError(f"{source}: the export {stated}; give --units {'|'.join(UNITS)}")
    return angle_factor(UNITS[units], Scale(wheel_radius_m=positive(wheel_radius_m, "--wheel-radius")))


def _one(table: Table, pattern: re.Pattern[str], what: str) -> str:
    found = [name for name in table.cells if pattern.fullmatch(name)]
    if len(found) != 1:
        there = ", ".join(map(repr, found or table.cells))
        raise RecordingError(f"{table.source}: one column {what} is needed; there is {there}")
    return found[0]


def _channels(table: Table, motor: str | None) -> dict[str, str]:
    """Columns by `voltage`, `position`, `velocity` of the motor meant."""
    motors: dict[str, dict[str, str]] = {}
    for name in table.cells:
        if match := _CHANNEL.fullmatch(name):
            motors.setdefault(match[2], {})[match[1]] = name
    whole = {name: found for name, found in motors.items() if "voltage" in found and len(found) > 1}
    if not whole:
        raise RecordingError(f"{table.source}: no motor has the columns voltage-... and position-... or velocity-...")
    meant = [name for name in whole if motor is None or name == motor or name.startswith(f"{motor}-")]
    if len(meant) != 1:
        raise RecordingError(f"{table.source}: the motors are {', '.join(whole)}; choose one with --motor")
    return whole[meant[0]]


def _rounds(table: Table, time: str, state: str, volts: str, shaft: str) -> list[tuple[int, str, float, float, float]]:
    """Number of the run, test, time [s], volts, shaft: each round in which a test ran and the shaft was logged."""
    times = table.numbers(time).tolist()
    if (late := np.flatnonzero(np.diff(times) < 0)).size:
        raise table.fault(int(late[0]) + 1, "the time runs backwards; correct or delete the row")
    voltages, shafts = table.held(volts), table.held(shaft)
    fresh = [bool(cell.strip()) for cell in table.cells[shaft]]
    states = _states(table, state)
    runs = np.cumsum([now != before for now, before in zip(states, ["none", *states], strict=False)]).tolist()
    rounds: list[tuple[int, str, float, float, float]] = []
    first = 0
    for row in range(1, len(times) + 1):
        if row < len(times) and times[row] - times[first] < ROUND_S:
            continue
        last = row - 1
        known = not (np.isnan(voltages[last]) or np.isnan(shafts[last]))
        if states[last] in STATES and any(fresh[first:row]) and known:
            rounds.append((runs[last], states[last], times[first], float(voltages[last]), float(shafts[last])))
        first = row
    return rounds


def _states(table: Table, name: str) -> list[str]:
    held, states = "none", []
    for row, cell in enumerate(table.cells[name]):
        held = cell.strip() or held
        if held not in STATES and held != "none":
            raise table.fault(row, f"the test {held[:40]!r} is not known; it is none or one of {', '.join(STATES)}")
        states.append(held)
    return states
