"""Which options of `jaxmotor export` belong to one format, or to those with controllers."""

import typer

LOOPS = ("json", "c", "arduino")
"""Formats with controllers."""
FORMATS = {
    "bandwidth": LOOPS,
    "position_bandwidth": LOOPS,
    "inertia": ("mujoco",),
    "resistance": ("spice",),
    "wheel_radius": ("wpilib",),
}


def check_used(to: str, **given: float | None) -> None:
    """**Raises:** `typer.BadParameter` where one of the options `given` is of no use to the format `to`."""
    for name, value in given.items():
        if value is not None and to not in FORMATS[name]:
            belongs = f"--{name.replace('_', '-')} belongs to --to {' or '.join(FORMATS[name])}"
            raise typer.BadParameter(f"{belongs}; {to} has no use for it, so leave it out")
