"""`jaxmotor export`: the motor for other programs, and controllers designed from it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from jaxmotor._errors import JaxmotorError

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxmotor.control import Hardware
    from jaxmotor.estimate import Model
    from jaxmotor.present.exports import Design

Format = Literal["control", "json", "c", "arduino", "wpilib", "mujoco", "spice"]


def export_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="Model that identify wrote.")],
    to: Annotated[
        Format, typer.Option("--to", help="python-control, JSON, C, Arduino library, WPILib, MuJoCo, SPICE.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write here instead of to the screen.")
    ] = None,
    counts_per_rev: Annotated[
        float | None,
        typer.Option(metavar="N", help="Encoder, all edges, per turn of the shaft; otherwise the recording's."),
    ] = None,
    supply: Annotated[float | None, typer.Option(metavar="V", help="Of the bridge; otherwise the recording's.")] = None,
    full_scale: Annotated[int, typer.Option(metavar="D", help="The duty that means the whole supply.")] = 250,
    period: Annotated[
        float | None, typer.Option(metavar="S", help="Of the controller; otherwise that of the recording.")
    ] = None,
    delay: Annotated[float, typer.Option(metavar="S", help="From the sample to the duty that follows from it.")] = 0.0,
    kind: Annotated[Literal["P", "PI"], typer.Option(help="Of the speed loop.")] = "PI",
    bandwidth: Annotated[
        float | None, typer.Option(metavar="HZ", help="Of the speed loop; otherwise as fast as is sensible.")
    ] = None,
    position_bandwidth: Annotated[float | None, typer.Option(metavar="HZ", help="Of the position loop.")] = None,
    overshoot: Annotated[float, typer.Option(metavar="PERCENT", help="The most that loops may overshoot.")] = 5.0,
    inertia: Annotated[
        float | None, typer.Option(metavar="KGM2", help="At the output shaft, for MuJoCo; voltage does not show it.")
    ] = None,
    resistance: Annotated[
        float | None, typer.Option(metavar="OHM", help="Of the winding, for SPICE; voltage does not show it.")
    ] = None,
    wheel_radius: Annotated[float | None, typer.Option(metavar="M", help="For WPILib's gains in metres.")] = None,
) -> None:
    """Write a model for python-control, C, Arduino, WPILib, MuJoCo or SPICE, with controllers designed from it."""
    from jaxmotor.cli._runtime import prepare_jax

    prepare_jax()
    from jaxmotor.estimate import read_model
    from jaxmotor.present import exports

    motor = read_model(model)
    rig = _rig(motor, to, counts_per_rev, supply, period, full_scale, delay)

    def designed() -> Design:
        assert rig is not None
        return exports.design(
            motor,
            rig,
            kind=kind,
            bandwidth_Hz=bandwidth,
            position_bandwidth_Hz=position_bandwidth,
            overshoot_percent=overshoot,
        )

    if to == "arduino":
        if output is None:
            raise JaxmotorError("an Arduino library is a folder: name it with -o")
        exports.write_library(output, exports.to_arduino(motor, designed()))
        typer.echo(f"wrote {output}; copy it into the folder libraries of your sketchbook")
        return
    writers: dict[Format, Callable[[], str]] = {
        "control": lambda: exports.to_python(motor, rig),
        "json": lambda: exports.to_export_json(motor, None if rig is None else designed()),
        "c": lambda: exports.to_c(motor, designed()),
        "wpilib": lambda: exports.to_wpilib(motor, wheel_radius),
        "mujoco": lambda: exports.to_mujoco(motor, inertia_kgm2=inertia, supply_V=supply),
        "spice": lambda: exports.to_spice(motor, resistance_ohm=resistance),
    }
    text = writers[to]()
    if output is None:
        typer.echo(text, nl=False)
        return
    from jaxmotor._files import write_text

    write_text(output, text)
    typer.echo(f"wrote {output}")


def _rig(
    model: Model,
    to: Format,
    counts_per_rev: float | None,
    supply: float | None,
    period: float | None,
    full_scale: int,
    delay: float,
) -> Hardware | None:
    """The rig where it is known; a C header needs it."""
    from jaxmotor.control import Hardware

    period = model.period_s if period is None else period
    if to in ("c", "arduino"):
        counts_per_rev = model.rig.counts_per_rev if counts_per_rev is None else counts_per_rev
        supply = model.rig.supply_V if supply is None else supply
    known = {"--counts-per-rev": counts_per_rev, "--supply": supply, "--period": period}
    missing = [name for name, value in known.items() if value is None]
    if to in ("c", "arduino") and missing:
        what = "a C header" if to == "c" else "an Arduino library"
        raise JaxmotorError(f"{what} needs {' and '.join(missing)}: counts, volts and ticks are its units")
    if counts_per_rev is not None and supply is not None and period is not None:
        return Hardware(period, counts_per_rev, supply, full_scale, delay)
    if to == "control" and period is not None:
        return Hardware(period, 1.0, 1.0, full_scale, delay)
    return None
