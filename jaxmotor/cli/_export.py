"""`jaxmotor export`: the motor for other programs, and controllers designed from it."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from jaxmotor._errors import JaxmotorError
from jaxmotor.cli._export_options import check_used

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxmotor.control import Hardware
    from jaxmotor.estimate import Model
    from jaxmotor.present.exports import Design

Format = Literal["control", "json", "c", "arduino", "wpilib", "mujoco", "spice"]
OPTIONS = {"counts_per_rev": "--counts-per-rev", "supply_V": "--supply", "period_s": "--period"}
"""That state what a rig needs."""


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
    full_scale: Annotated[
        int | None,
        typer.Option(metavar="D", help="The duty that means the whole supply; otherwise the recording's, or 250."),
    ] = None,
    period: Annotated[
        float | None, typer.Option(metavar="S", help="Of the controller; otherwise that of the recording.")
    ] = None,
    delay: Annotated[
        float | None,
        typer.Option(metavar="S", help="From the sample to the duty that follows from it; otherwise the recording's."),
    ] = None,
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
    single = {"inertia": inertia, "resistance": resistance, "wheel_radius": wheel_radius}
    check_used(to, bandwidth=bandwidth, position_bandwidth=position_bandwidth, **single)
    from jaxmotor._runtime import keep_programs

    keep_programs(threads=False)
    from jaxmotor.estimate import read_model
    from jaxmotor.present import exports

    motor = read_model(model)
    given = {"counts_per_rev": counts_per_rev, "supply_V": supply, "period_s": period}
    rig = functools.partial(_rig, motor, to, given | {"full_scale": full_scale, "delay_s": delay})
    asked = counts_per_rev is not None or supply is not None

    def designed() -> Design | None:
        hardware = rig()
        return hardware and exports.design(
            motor,
            hardware,
            kind=kind,
            bandwidth_Hz=bandwidth,
            position_bandwidth_Hz=position_bandwidth,
            overshoot_percent=overshoot,
        )

    def needed() -> Design:
        design = designed()
        assert design is not None, "a C header's rig is known, or an error"
        return design

    if to == "arduino":
        if output is None:
            raise JaxmotorError("an Arduino library is a folder: name it with -o")
        exports.write_library(output, exports.to_arduino(motor, needed()))
        typer.echo(f"wrote {output}; copy it into the folder libraries of your sketchbook")
        return
    writers: dict[Format, Callable[[], str]] = {
        "control": lambda: exports.to_python(motor, rig()),
        "json": lambda: exports.to_export_json(motor, _possible(designed, asked)),
        "c": lambda: exports.to_c(motor, needed()),
        "wpilib": lambda: exports.to_wpilib(motor, wheel_radius),
        "mujoco": lambda: exports.to_mujoco(motor, inertia_kgm2=inertia, supply_V=supply),
        "spice": lambda: exports.to_spice(motor, resistance_ohm=resistance),
    }
    text = writers[to]()
    guessed = {"mujoco": (inertia, exports.GUESSED_INERTIA), "spice": (resistance, exports.GUESSED_RESISTANCE)}
    if to in guessed and guessed[to][0] is None:
        typer.echo(f"note: {guessed[to][1]}", err=True)
    if output is None:
        typer.echo(text, nl=False)
        return
    from jaxmotor._files import write_text

    write_text(output, text)
    typer.echo(f"wrote {output}")


def _possible(designed: Callable[[], Design | None], asked: bool) -> Design | None:
    """The controllers; None, and why on the error stream, where they were not `asked` for and are not possible."""
    try:
        return designed()
    except JaxmotorError as error:
        if asked:
            raise
        typer.echo(f"jaxmotor: without controllers: {error}", err=True)
        return None


def _rig(model: Model, to: Format, given: dict[str, Any]) -> Hardware | None:
    """The rig where it is stated or `given`; a C header needs it, and python-control no more of it than the times."""
    from jaxmotor.control import hardware_of

    stated = {"counts_per_rev": model.rig.counts_per_rev, "supply_V": model.rig.supply_V, "period_s": model.period_s}
    missing = [name for name, value in stated.items() if value is None and given[name] is None]
    if missing and to in ("c", "arduino"):
        what = "a C header" if to == "c" else "an Arduino library"
        options = " and ".join(OPTIONS[name] for name in missing)
        raise JaxmotorError(f"{what} needs {options}: counts, volts and ticks are its units")
    if to == "control" and "period_s" not in missing:
        given = given | dict.fromkeys(missing, 1.0)
    elif missing:
        return None
    return hardware_of(model, **given)
