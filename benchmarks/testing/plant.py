"""The emulated bench's plant, called directly: many motors, no board.

with Plant('[coulomb_friction]\\nvolts_V = 0.3') as plant:
    run = plant.sequence(duty, period_s=0.005)
    run.count, run.speed
"""

import ctypes
import dataclasses
from pathlib import Path

import numpy as np

from testing.built import BUILD

LIBRARY = BUILD / "libplant.so"

BRAKE, COAST, OFF = 0, 1, 2
FULL_SCALE = 250

_double = ctypes.c_double
_doubles = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
_int32s = np.ctypeslib.ndpointer(np.int32, flags="C_CONTIGUOUS")
_int64s = np.ctypeslib.ndpointer(np.int64, flags="C_CONTIGUOUS")
_READINGS = ("time", "angle", "speed", "current", "supply", "resistance", "load_angle", "load_speed")


class Edge(ctypes.Structure):
    _fields_ = (("after_s", _double), ("count", ctypes.c_int64))


@dataclasses.dataclass(frozen=True)
class Run:
    """Arrays (n,), one element per tick, all from before that tick's duty acts."""

    duty: np.ndarray
    """What was driven, of full scale."""
    count: np.ndarray
    """What the encoder counted."""
    angle: np.ndarray
    """True angle [rad]."""
    speed: np.ndarray
    """True speed [rad/s]."""


@dataclasses.dataclass(frozen=True)
class Linear:
    """The motor without effects; SI, at the output shaft."""

    gain: float
    pole: float
    electrical_time_constant: float
    resistance: float
    torque_constant: float
    inertia: float
    damping: float


def load(path: Path = LIBRARY) -> ctypes.CDLL:
    library = ctypes.CDLL(str(path))
    library.plant_create.restype = ctypes.c_void_p
    library.plant_create.argtypes = (ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int)
    library.plant_destroy.argtypes = (ctypes.c_void_p,)
    library.plant_destroy.restype = None
    library.plant_hold.argtypes = (ctypes.c_void_p, _double, ctypes.c_int, _double)
    library.plant_hold.restype = None
    library.plant_edges.argtypes = (ctypes.c_void_p, ctypes.POINTER(ctypes.POINTER(Edge)))
    library.plant_count.restype = ctypes.c_int64
    library.plant_count.argtypes = (ctypes.c_void_p,)
    library.plant_linear.argtypes = (ctypes.c_void_p, _doubles)
    library.plant_linear.restype = None
    for name in _READINGS:
        function = getattr(library, f"plant_{name}")
        function.restype, function.argtypes = _double, (ctypes.c_void_p,)
    head = (ctypes.c_void_p, ctypes.c_int, _double, _double, ctypes.c_int, ctypes.c_int)
    library.plant_sequence.argtypes = (*head, _int32s, _int64s, _doubles, _doubles, _doubles)
    library.plant_sequence.restype = None
    loop = (_int32s, ctypes.c_uint16, ctypes.c_uint16, _int64s)
    library.plant_loop.argtypes = (*head, *loop, _int32s, _int64s, _doubles, _doubles)
    library.plant_loop.restype = None
    return library


class Plant:
    """One plant, from the text of a plant file (firmware/emulator/README.md). Time runs on from call to call."""

    def __init__(self, toml: str = "", library: ctypes.CDLL | None = None):
        self._library = library or load()
        error = ctypes.create_string_buffer(300)
        self._plant = self._library.plant_create(toml.encode(), error, len(error))
        if not self._plant:
            raise ValueError(error.value.decode())

    def __enter__(self) -> "Plant":
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        if getattr(self, "_plant", None):
            self._library.plant_destroy(self._plant)
            self._plant = None

    def __getattr__(self, name: str) -> float:
        if name not in _READINGS:
            raise AttributeError(name)
        return getattr(self._library, f"plant_{name}")(self._plant)

    @property
    def count(self) -> int:
        return self._library.plant_count(self._plant)

    @property
    def linear(self) -> Linear:
        values = np.zeros(7)
        self._library.plant_linear(self._plant, values)
        return Linear(*values.tolist())

    def hold(self, duty: float, seconds: float, drive: int = BRAKE) -> list[tuple[float, int]]:
        """Hold `duty` (-1..1); returns the encoder's (time after the start [s], count)."""
        self._library.plant_hold(self._plant, duty, drive, seconds)
        edges = ctypes.POINTER(Edge)()
        n = self._library.plant_edges(self._plant, ctypes.byref(edges))
        return [(edges[k].after_s, edges[k].count) for k in range(n)]

    def sequence(self, duty, *, period_s=0.005, delay_s=0.0, drive=BRAKE, full_scale=FULL_SCALE, supply=None) -> Run:
        """Drive the duties, one per tick. `supply` (n,) float64 receives the bridge's supply [V]."""
        duty = np.ascontiguousarray(duty, np.int32)
        n = len(duty)
        run = Run(duty, np.zeros(n, np.int64), np.zeros(n), np.zeros(n))
        supply = np.zeros(n) if supply is None else supply
        self._library.plant_sequence(
            self._plant, n, period_s, delay_s, full_scale, drive, duty, run.count, run.angle, run.speed, supply
        )
        return run

    def loop(
        self, reference, kp: int, ki: int = 0, *, period_s=0.005, delay_s=0.0, drive=BRAKE, full_scale=FULL_SCALE
    ) -> Run:
        """The board's speed loop; `reference` per tick and gains in the board's integer units."""
        reference = np.ascontiguousarray(reference, np.int32)
        n = len(reference)
        run = Run(np.zeros(n, np.int32), np.zeros(n, np.int64), np.zeros(n), np.zeros(n))
        state = np.array([self.count, 0], np.int64)
        self._library.plant_loop(
            self._plant, n, period_s, delay_s, full_scale, drive,
            reference, kp, ki, state, run.duty, run.count, run.angle, run.speed,
        )  # fmt: skip
        return run
