"""Recordings to read, write, damage and import."""

import os
from pathlib import Path

import numpy as np
import pytest

from jaxmotor.recording import Recording, Segment

TEXT = """\
# jaxmotor recording 1
# motor = "Pololu 2213, unit 7"
# period_s = 0.005
# counts_per_rev = 617.4
# duty_full_scale = 255
# supply_V = 7.4
# drive = "brake"
# [[segment]]
# kind = "sine"
# start_s = 0.0
# frequency_Hz = 5.03
# amplitude_V = 5.1
# [[segment]]
# kind = "step"
# start_s = 4.0
# at_rest = false
segment,tick,duty,count
0,0,0,0
0,1,27,0
0,2,54,3
1,0,200,9
1,2,200,30
"""
FIRST_ROW = TEXT[: TEXT.index("0,0,0,0")].count("\n") + 1


def same(a: Recording, b: Recording) -> bool:
    """Equal bit for bit, but for the file's name."""
    fields = (
        "period_s",
        "counts_per_rev",
        "duty_full_scale",
        "supply_V",
        "drive",
        "speed_window_s",
        "speed_window_rows",
        "count_resets",
        "header",
    )
    return (
        all(getattr(a, name) == getattr(b, name) for name in fields)
        and len(a.segments) == len(b.segments)
        and all(map(same_segment, a.segments, b.segments))
    )


def same_segment(a: Segment, b: Segment) -> bool:
    plain = ("kind", "start_s", "at_rest", "parameters")
    arrays = ("time_s", "volts", "tick", "duty", "count", "angle_rad", "speed_rad_s", "supply_V", "current_A", "unread")
    return (
        all(getattr(a, name) == getattr(b, name) for name in plain)
        and all(same_array(getattr(a, name), getattr(b, name)) for name in arrays)
        and list(a.extra) == list(b.extra)
        and all(same_array(a.extra[name], b.extra[name]) for name in a.extra)
    )


def same_array(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    if a is None or b is None:
        return a is b
    # -0.0 equals 0.0, but is another number to write
    return a.dtype.kind == b.dtype.kind and a.tolist() == b.tolist() and list(map(str, a)) == list(map(str, b))


def counted(volts: np.ndarray, speed: np.ndarray, **fields) -> Recording:
    """One segment of ticks of 5 ms at `volts`, whose counts advance by `speed` per tick."""
    count = np.floor(np.cumsum(speed) - speed).astype(np.int64)
    segment = {"kind": "other", "start_s": 0.0, "at_rest": False, "parameters": {}} | fields
    tick = np.arange(len(volts))
    return Recording(
        segments=(Segment(time_s=tick * 0.005, tick=tick, volts=volts, count=count, **segment),),
        source="made.csv",
        period_s=0.005,
        counts_per_rev=1000.0,
        supply_V=12.0,
    )


def measured_data() -> Path:
    """The folder of measured logs, which are not part of the project."""
    folder = Path(os.environ.get("JAXMOTOR_DATA", Path(__file__).parents[2] / "../shared/data"))
    if not folder.is_dir():
        pytest.skip(f"no measured logs in {folder}; set JAXMOTOR_DATA to their folder")
    return folder
