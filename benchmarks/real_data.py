"""Linear motors identified from measured logs of real hobby gearmotors: the table of docs/real-data.md.

    python benchmarks/real_data.py

The logs are looked for in $JAXMOTOR_DATA, else in ../shared/data beside the checkout. Each is fitted and scored on
itself, to compare with fits that others made by hand; the fits by hand are first order without delay or friction.
"""

import os
from pathlib import Path

from jaxmotor import JaxmotorError, Recording, identify, import_log

FOLDER = Path(os.environ.get("JAXMOTOR_DATA", Path(__file__).parent.parent.parent / "shared" / "data"))
BY_HAND = {"brake/prbs_open": 78.7, "brake/step_open": 90.3, "coast/prbs_open": 28.3, "coast/step_open": 38.0}
FILES = (
    "brake/prbs_open",
    "brake/step_open",
    "brake/stairs_closed",
    "brake/step_closed",
    "brake/profile_closed",
    "coast/prbs_open",
    "coast/step_open",
    "coast/stairs_closed",
    "coast/step_closed",
    "coast/profile_closed",
)


def measured(name: str) -> Recording:
    """The log `name` (`brake/prbs_open`) as a recording: speeds are means over 20 ms, or angles."""
    path = FOLDER / f"undcmotor_{name}.csv"
    columns = next(line for line in path.read_text().splitlines() if not line.startswith("#"))
    if "y_deg_per_s" in columns:
        return import_log(path, time="t_s", input="u_V:V", speed="y_deg_per_s:deg/s", speed_window_s=0.02)
    return import_log(path, time="t_s", input="u_V:V", angle="y_deg:deg")


def row(name: str) -> str:
    recording = measured(name)
    rows = sum(map(len, recording.segments))
    try:
        fit = identify(recording)
    except JaxmotorError as error:
        return f"| {name} | {rows} | | | | | {str(error).partition(': ')[2]} |"
    gain, pole = float(fit.motor.gain), float(fit.motor.pole)
    errors = [1.96 * float(fit.standard_error.gain), 1.96 * float(fit.standard_error.pole)]
    by_hand = f"{BY_HAND[name]:.1f}" if name in BY_HAND else ""
    return (
        f"| {name} | {rows} | {gain:.3g} ± {errors[0]:.2g} | {pole:.3g} ± {errors[1]:.2g} | {1e3 * fit.offset_V:.0f} | "
        f"{fit.fit_percent:.1f} | {by_hand} |"
    )


def main() -> None:
    if not FOLDER.is_dir():
        print(f"no measured logs in {FOLDER}; name their folder with JAXMOTOR_DATA")
        return
    print("| log | rows | gain [rad/s/V] | pole [rad/s] | offset [mV] | fit % | by hand % |")
    print("|---|---|---|---|---|---|---|")
    for name in FILES:
        print(row(name))


if __name__ == "__main__":
    main()
