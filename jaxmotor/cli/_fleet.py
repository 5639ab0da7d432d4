"""`jaxmotor fleet`: every motor of a data set, one row each."""

from __future__ import annotations

import contextlib
import itertools
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jaxmotor._sentences import printable
from jaxmotor.cli._progress import progress

if TYPE_CHECKING:
    from jaxmotor.fleet import Done, Summary

MOST_OUTLIERS = 10
"""That are printed."""
MOST_SKIPPED = 10
"""That are named."""


def fleet_command(
    dataset: Annotated[
        Path, typer.Argument(metavar="DATASET", help="Folder of recordings (.csv, .parquet), or a Parquet file.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="RESULTS.parquet", help="One row for each motor.")],
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS|local", help="Run on a Dask cluster: tcp://HOST:8786, or local.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Cores, or workers of a local cluster. [default: all cores]")
    ] = None,
    friction: Annotated[bool, typer.Option("--friction", help="Fit Coulomb friction and a dead zone, too.")] = False,
    diagnose: Annotated[
        bool, typer.Option("--diagnose", help="Name what each linear model gets wrong, too: seconds for each motor.")
    ] = False,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw the motors, their spread, and who does not belong.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Draws encoder offsets, and shuffles.")] = 0,
) -> None:
    """Identify every motor of a data set. A run that was stopped goes on where it was."""
    if figure is not None and figure.suffix not in (".png", ".svg"):
        raise typer.BadParameter("--figure is a .png or .svg file")
    from jaxmotor._runtime import keep_programs

    keep_programs(threads=False)
    from jaxmotor.fleet import Options, identify_fleet

    options = Options(friction, seed, diagnose)
    with _progress() as done:
        summary = identify_fleet(dataset, output, options=options, cluster=cluster, workers=workers, progress=done)
    verdicts, undiagnosed = _diagnoses(summary.output) if diagnose else ([], 0)
    lines = [_text(summary), *verdicts, *_population(summary, friction, figure)]
    typer.echo("\n".join(lines))
    if summary.problems or summary.skipped or undiagnosed:
        raise typer.Exit(1)


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[Done], None]]:
    """What was done, on the error output: a bar with motors per second and the time left, or plain lines where that is
    no terminal."""
    motors, parts, began = {True: 0, False: 0}, itertools.count(1), time.monotonic()

    def rate(part: Done) -> str:
        motors[part.before] += part.motors
        return f"{motors[False] / max(time.monotonic() - began, 1e-3):.3g} motors/s" if motors[False] else "..."

    with _bar() if sys.stderr.isatty() else _lines() as tell:
        yield lambda part: tell(next(parts), part.parts, rate(part), sum(motors.values()))


Tell = Callable[[int, int, str, int], None]
"""Takes the number of parts that are done, of all parts, the rate, and how many motors that were."""


@contextlib.contextmanager
def _bar() -> Iterator[Tell]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns: list[Any] = [
        TextColumn("motors {task.fields[motors]}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("parts, {task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    ]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", motors=0, rate="", total=None)
        yield lambda done, parts, rate, motors: bar.update(task, completed=done, total=parts, motors=motors, rate=rate)


@contextlib.contextmanager
def _lines() -> Iterator[Tell]:
    with progress("identifying") as say:
        yield lambda done, parts, rate, motors: say(f"{motors} motors, {done} of {parts} parts, {rate}")


def _text(summary: Summary) -> str:
    lines = [f"{summary.output}: {summary.motors} motors"]
    if summary.problems:
        lines.append(f"  {summary.problems} of them could not be identified: column 'problem' says why")
    if summary.doubled:
        lines.append(f"  {summary.doubled} names stand for more than one motor: column 'source' tells them apart")
    lines += [f"  skipped: {printable(name)}" for name in summary.skipped[:MOST_SKIPPED]]
    if len(summary.skipped) > MOST_SKIPPED:
        lines.append(f"  skipped: {len(summary.skipped) - MOST_SKIPPED} more")
    return "\n".join(lines)


def _diagnoses(output: Path) -> tuple[list[str], int]:
    """How many motors have which verdict and which effects, and how many could not be diagnosed."""
    from jaxmotor.fleet import count_verdicts

    counts = count_verdicts(output)
    lines = [f"  {number} {verdict}: {effects}" for (verdict, effects), number in counts.verdicts]
    if counts.failed:
        lines.append(f"  {counts.failed} of them could not be diagnosed: column 'diagnosis_problem' says why")
    return lines, counts.failed


def _population(summary: Summary, friction: bool, figure: Path | None) -> list[str]:
    """What the motors have in common, where there are enough of them."""
    from jaxmotor._errors import JaxmotorError
    from jaxmotor.fleet import population, read_results

    names = ("gain_rad_s_V", "pole_rad_s", *(("coulomb_friction_V",) if friction else ()))
    try:
        found = population(read_results(summary.output), names)
    except JaxmotorError as error:
        return [f"  no population: {error}"]
    lines = ["  spread between motors (without the errors of the estimates):"]
    for name, middle, spread, is_size in zip(
        names, found.sizes(found.mean), found.spread, found.logarithmic, strict=True
    ):
        told = f"standard deviation {f'{100 * spread:.3g} %' if is_size else f'{spread:.3g}'}"
        if name in found.without_spread:
            told = "the same for all: no spread, correlation not defined"
        lines.append(f"    {name:<20s} {middle:.5g}, {told}")
    lines += [
        f"  does not belong: {outlier.motor} ({outlier.because}, {outlier.deviation:+.1f} standard deviations)"
        for outlier in found.outliers[:MOST_OUTLIERS]
    ]
    if len(found.outliers) > MOST_OUTLIERS:
        lines.append(f"  and {len(found.outliers) - MOST_OUTLIERS} more")
    if figure is not None:
        from jaxmotor.present import population_figure, save

        save(population_figure(found), figure)
        lines.append(f"  wrote {figure}")
    return lines
