"""`jaxmotor simulate`: a plan run on a model instead of on the motor."""

from pathlib import Path
from typing import Annotated

import typer

from jaxmotor._errors import JaxmotorError


def simulate_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="Model that identify wrote.")],
    plan: Annotated[str, typer.Option("--plan", metavar="PLAN", help="A TOML file, or a built-in one: full, paper.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="REC.csv", help="The recording, format 1.")],
    counts_per_rev: Annotated[
        float | None, typer.Option(metavar="N", help="Encoder, all edges; otherwise the plan's, or the model's.")
    ] = None,
    supply: Annotated[
        float | None, typer.Option(metavar="V", help="Of the bridge; otherwise the plan's, or the model's.")
    ] = None,
    full_scale: Annotated[
        int | None,
        typer.Option(metavar="D", help="The duty that means the whole supply; otherwise the model's, or 250."),
    ] = None,
    delay: Annotated[
        float | None,
        typer.Option(metavar="S", help="From a tick to the moment its duty takes effect; otherwise the model's."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Where within a count the encoder begins.")] = 0,
) -> None:
    """Simulate a plan of jaxmotor record on a model, with its effects, encoder and duties, and write the recording."""
    from jaxmotor.bench import load_plan

    loaded = load_plan(plan)
    from jaxmotor._runtime import keep_programs

    keep_programs(threads=False)
    from jaxmotor.control import hardware_of, simulate_plan
    from jaxmotor.estimate import read_model
    from jaxmotor.recording import write

    motor = read_model(model)
    counts = loaded.counts_per_rev if counts_per_rev is None else counts_per_rev
    volts = loaded.supply_V if supply is None else supply
    known = {"--counts-per-rev": (counts, motor.rig.counts_per_rev), "--supply": (volts, motor.rig.supply_V)}
    missing = [name for name, values in known.items() if values == (None, None)]
    if missing:
        raise JaxmotorError(f"{plan}: plan and model do not say everything about the rig; add {' and '.join(missing)}")
    hardware = hardware_of(
        motor,
        period_s=loaded.period_s,
        counts_per_rev=counts,
        supply_V=volts,
        full_scale=full_scale,
        delay_s=delay,
    )
    recording = simulate_plan(motor, loaded, hardware, seed=seed)
    write(recording, output)
    typer.echo(f"wrote {output}: {len(recording.segments)} segments, {loaded.ticks} ticks, {loaded.seconds:.4g} s")
