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
        float | None, typer.Option(metavar="N", help="Encoder, all edges; otherwise the plan's.")
    ] = None,
    supply: Annotated[float | None, typer.Option(metavar="V", help="Of the bridge; otherwise the plan's.")] = None,
    full_scale: Annotated[int, typer.Option(metavar="D", help="The duty that means the whole supply.")] = 250,
    delay: Annotated[float, typer.Option(metavar="S", help="From a tick to the moment its duty takes effect.")] = 0.0,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Where within a count the encoder begins.")] = 0,
) -> None:
    """Simulate a plan of jaxmotor record on a model, with its effects, encoder and duties, and write the recording."""
    from jaxmotor.bench import load_plan

    loaded = load_plan(plan)
    counts = loaded.counts_per_rev if counts_per_rev is None else counts_per_rev
    volts = loaded.supply_V if supply is None else supply
    if counts is None or volts is None:
        missing = " and ".join(
            name for name, value in (("--counts-per-rev", counts), ("--supply", volts)) if value is None
        )
        raise JaxmotorError(f"{plan}: the plan does not say everything about the rig; add {missing}")
    from jaxmotor.cli._runtime import prepare_jax

    prepare_jax()
    from jaxmotor.control import Hardware, simulate_plan
    from jaxmotor.estimate import read_model
    from jaxmotor.recording import write

    hardware = Hardware(loaded.period_s, counts, volts, full_scale, delay)
    recording = simulate_plan(read_model(model), loaded, hardware, seed=seed)
    write(recording, output)
    typer.echo(f"wrote {output}: {len(recording.segments)} segments, {loaded.ticks} ticks, {loaded.seconds:.4g} s")
