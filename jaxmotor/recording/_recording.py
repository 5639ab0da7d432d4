"""What was measured: segments of ticks in SI units, as numpy arrays (format 1)."""

import collections
import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._shown import Shown, data_frame

KINDS = ("sine", "multisine", "chirp", "prbs", "step", "ramp", "closed_loop", "rest", "other")
Measured = Literal["count", "angle", "speed"]


class RecordingError(JaxmotorError):
    """A recording that cannot be used, with file, line and remedy."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Segment:
    """One experiment. Row k holds what was measured at `time_s[k]`, then `volts[k]` is applied until row k+1.

    Exactly one of `count`, `angle_rad`, `speed_rad_s` is given. All arrays have the same length n >= 1.
    """

    kind: str
    """One of `KINDS`."""
    start_s: float
    """Time of the first row since the recording began [s]."""
    at_rest: bool
    """The motor stood still at the first row."""
    parameters: Mapping[str, Any]
    """The segment's other header keys, as written: `frequency_Hz`, `amplitude_V`, `reference_rad_s`, ..."""
    time_s: np.ndarray
    """(n,) float64, increasing, from the segment's start [s]."""
    volts: np.ndarray
    """(n,) float64, mean bridge voltage from this row on [V]; of duties, what they made of the supply (`supplied`)."""
    tick: np.ndarray | None = None
    """(n,) int64, time in periods; a skipped number is a lost sample. None where time was logged."""
    duty: np.ndarray | None = None
    """(n,) int64, as logged. None where volts were logged."""
    count: np.ndarray | None = None
    """(n,) int64, the running encoder counter [1]."""
    angle_rad: np.ndarray | None = None
    """(n,) float64, output shaft [rad]."""
    speed_rad_s: np.ndarray | None = None
    """(n,) float64, output shaft [rad/s], the mean over `Recording.speed_window_s` before the row."""
    supply_V: np.ndarray | None = None
    """(n,) float64, measured supply at the row [V]; NaN where it was not read. Its scale is `Recording.supply_V`."""
    current_A: np.ndarray | None = None
    """(n,) float64, measured current [A]."""
    extra: Mapping[str, np.ndarray] = dataclasses.field(default_factory=dict)
    """Columns that the format does not know, as text; written back as they came."""
    unread: np.ndarray | None = None
    """(n,) bool, the rows without a reading: the shaft's column has there what lies between those beside them, and
    nothing is compared with it. None: all were read."""
    begins_rad: float | None = None
    """Angle of the shaft at the first row [rad], where a diagnosis has found it; no file holds it."""

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        logged = [name for name in ("count", "angle_rad", "speed_rad_s") if getattr(self, name) is not None]
        return f"Segment({self.kind!r}, start_s={self.start_s:g}, {len(self)} rows of {', '.join(logged)})"

    @property
    def sine_Hz(self) -> float | None:
        """Frequency of a sine, as its header states it [Hz]; None where it does not, and of other kinds."""
        stated = self.parameters.get("frequency_Hz") if self.kind == "sine" else None
        return float(stated) if isinstance(stated, int | float) and not isinstance(stated, bool) else None

    @property
    def read(self) -> np.ndarray:
        """(n,) bool, the rows at which the shaft was read."""
        return np.ones(len(self), bool) if self.unread is None else ~self.unread

    @property
    def shaft(self) -> np.ndarray:
        """(n,) `count`, `angle_rad` or `speed_rad_s`, whichever was logged. **Raises:** `RecordingError` without."""
        for column in (self.count, self.angle_rad, self.speed_rad_s):
            if column is not None:
                return column
        raise RecordingError("a segment has no count, angle_rad or speed_rad_s; one of them must be logged")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Recording(Shown):
    """Segments that one motor produced on one rig, and what is needed to read them."""

    segments: tuple[Segment, ...]
    source: str
    """Where it came from (a file name), for messages."""
    period_s: float | None = None
    """Time from one tick to the next [s]; None where time was logged."""
    counts_per_rev: float | None = None
    """Encoder counts, all edges, per turn of the output shaft [1/rev]."""
    duty_full_scale: float | None = None
    """The duty that means the whole supply [1]."""
    supply_V: float | None = None
    """Supply of the bridge, unloaded, when the recording began [V]."""
    drive: Literal["brake", "coast"] | None = None
    """What the bridge does between pulses; None where not known."""
    speed_window_s: float | None = None
    """Each speed is the mean over this long before its row [s]; 0 is instantaneous; None where not known."""
    speed_window_rows: int | None = None
    """Each speed is the mean from so many rows before its own row to it, in however long: `speed_window_s` is then how
    long that takes where rows are even. 0: from the row before it that has a speed, or the first of its segment;
    `speed_window_s` is then how long that usually is. None: the mean is over a fixed time."""
    speed_pulses_per_rev: float | None = None
    """Each speed is from the time between the last two pulses of a sensor, so many in a turn of the shaft [1/rev];
    `speed_window_s` is then over how long speeds usually are. None: they are not."""
    duty_delay_s: float | None = None
    """From the moment at which a row was measured to that at which its voltage acts [s]; None is none."""
    count_resets: bool = False
    """The counter starts anew in each segment."""
    header: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Free text (`motor`, `rig`, `firmware`, `created`, `notes`) and unknown keys, as written."""

    @property
    def measured(self) -> Measured:
        """Which of the three was logged."""
        first = self.segments[0]
        if first.count is not None:
            return "count"
        return "angle" if first.angle_rad is not None else "speed"

    @property
    def count_rad(self) -> float:
        """One count [rad]; a turn where counts per turn are not known."""
        return 2 * np.pi / (self.counts_per_rev or 1.0)

    @property
    def name(self) -> str:
        """File name without its folder."""
        return Path(self.source).name

    def to_dataframe(self) -> Any:
        """All rows as pandas' data frame: `segment`, `kind`, `time_s` from the segment's start, and what was logged.

        **Raises:** `JaxmotorError` where pandas is not installed.
        """
        names = [field.name for field in dataclasses.fields(Segment) if field.name != "unread"]
        logged = [name for name in names if isinstance(getattr(self.segments[0], name), np.ndarray)]
        sizes = [len(segment) for segment in self.segments]
        about = {"segment": np.arange(len(sizes)), "kind": np.array([segment.kind for segment in self.segments])}
        rows = {name: np.concatenate([getattr(segment, name) for segment in self.segments]) for name in logged}
        read = np.concatenate([segment.read for segment in self.segments])
        rows |= {name: np.where(read, rows[name], np.nan) for name in ("angle_rad", "speed_rad_s") if name in rows}
        return data_frame({name: np.repeat(values, sizes) for name, values in about.items()} | rows)

    def _title(self) -> str:
        rows = sum(len(segment) for segment in self.segments)
        pace = "uneven" if self.period_s is None else f"one per {self.period_s:g} s"
        return f"Recording {self.name}: {rows} rows, {pace}, of {len(self.segments)} segments; {self.measured} measured"

    def _remarks(self) -> tuple[str, ...]:
        number = collections.Counter(segment.kind for segment in self.segments)
        return (", ".join(f"{kind}: {count}" for kind, count in number.items()),)


def mean_speeds(recording: Recording, segment: Segment) -> np.ndarray:
    """(n - 1,) from each row to the next [rad/s]; of logged speeds that of the next."""
    if segment.speed_rad_s is not None:
        return segment.speed_rad_s[1:]
    return np.diff(angle_of(recording, segment)) / np.diff(segment.time_s)


def angle_of(recording: Recording, segment: Segment) -> np.ndarray:
    """(n,) angle since the first row of `segment`, where counts or angles were logged [rad]."""
    if segment.count is not None:
        return (segment.count - segment.count[0]) * recording.count_rad
    assert segment.angle_rad is not None
    return segment.angle_rad - segment.angle_rad[0]
