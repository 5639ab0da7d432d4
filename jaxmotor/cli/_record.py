"""`jaxmotor record`: a plan runs on a board, and what it did becomes a recording."""

import contextlib
import dataclasses
import math
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jaxmotor._errors import JaxmotorError

if TYPE_CHECKING:
    import numpy as np

ENOUGH = 0.002
"""With --live a sine ends when the standard error of its gain is below this share of it..."""
PERIODS = 2
"""...and so many periods have passed."""


def record_command(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="REC.csv", help="Recording to write.")],
    port: Annotated[
        str | None, typer.Option(metavar="PORT|emulated", help="/dev/ttyUSB0, socket://HOST:PORT, or emulated.")
    ] = None,
    plan: Annotated[str | None, typer.Option(metavar="PLAN.toml|paper|full", help="What to run.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on after the last whole experiment.")] = False,
    recover: Annotated[bool, typer.Option("--recover", help="Write what REC.csv.part holds; needs no board.")] = False,
    no_check: Annotated[bool, typer.Option("--no-check", help="Leave out the wiring check.")] = False,
    live: Annotated[
        bool, typer.Option("--live", help="Fit each sine as it comes, and end it when it is known.")
    ] = False,
    whole_hertz: Annotated[bool, typer.Option("--whole-hertz", help="Leave frequencies as the plan states.")] = False,
    supply: Annotated[float | None, typer.Option(metavar="V", help="As a voltmeter shows it.")] = None,
    counts_per_rev: Annotated[float | None, typer.Option(metavar="N", help="Instead of the board's.")] = None,
    baud: Annotated[int, typer.Option(help="Of the board after a reset.")] = 115200,
    plant: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="emulated: the motor.")] = None,
    seed: Annotated[int | None, typer.Option(help="emulated: where the shaft stands, and random torques.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing output.")] = False,
) -> None:
    """Run a plan on the motor and record it; Ctrl-C stops the motor and leaves a valid recording."""
    from jaxmotor.bench import Port, load_plan, record
    from jaxmotor.bench import recover as recover_recording

    if recover:
        typer.echo(_summary(recover_recording(output, _Live(_Plain(), False)), output))
        return
    if port is None:
        raise typer.BadParameter("say where the board is with --port /dev/ttyUSB0, or --port emulated")
    if port != "emulated" and (plant is not None or seed is not None):
        raise typer.BadParameter("--plant and --seed belong to --port emulated")
    if plant is not None and not plant.is_file():
        raise JaxmotorError(f"{plant}: {'is no file' if plant.exists() else 'there is no such plant file'}")
    chosen = None if plan is None else load_plan(plan, whole_hertz=whole_hertz)
    if chosen is not None:
        stated = {"supply_V": supply, "counts_per_rev": counts_per_rev}
        chosen = dataclasses.replace(chosen, **{key: value for key, value in stated.items() if value is not None})
    with _shown() as show, _Live(show, live) as watch:
        recording = record(
            chosen,
            lambda: Port(port, baud, plant=plant, seed=seed),
            output,
            resume=resume,
            force=force,
            check=not no_check,
            watch=watch,
        )
    typer.echo(_summary(recording, output))


class _Plain:
    """Progress as a line per experiment, where output is no terminal."""

    def __init__(self) -> None:
        self._experiment = -1

    def say(self, text: str) -> None:
        typer.echo(text)

    def progress(self, progress: Any) -> None:
        if progress.experiment != self._experiment:
            self._experiment = progress.experiment
            typer.echo(_where(progress))


class _Bar:
    """Progress as a bar."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar
        self._task = bar.add_task("starting", total=None)

    def say(self, text: str) -> None:
        self._bar.console.print(text, markup=False, highlight=False)

    def progress(self, progress: Any) -> None:
        self._bar.update(
            self._task, total=progress.total_s, completed=progress.done_s, description=_where(progress, timed=False)
        )


@contextlib.contextmanager
def _shown() -> Iterator[_Plain | _Bar]:
    if not sys.stdout.isatty():
        yield _Plain()
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), transient=True) as bar:
        yield _Bar(bar)


class _Live:
    """Hands progress on and, where wanted, fits sines beside the recording, in a thread of its own."""

    def __init__(self, show: _Plain | _Bar, fits: bool) -> None:
        self._show = show
        self._pool = ThreadPoolExecutor(1) if fits else None
        self._known: tuple[int, Future[tuple[complex, float]] | None] = (-1, None)

    def __enter__(self) -> "_Live":
        return self

    def __exit__(self, *exc: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=exc[0] is not None)

    def say(self, text: str) -> None:
        self._show.say(text)

    def progress(self, progress: Any) -> None:
        self._show.progress(progress)

    def ended(self, run: Any, piece: Any) -> None:
        if self._pool is not None and _fits(run, piece):
            data = _data(run, piece)
            self._pool.submit(_fit, *data).add_done_callback(lambda done: self._tell(data[0], done))

    def enough(self, run: Any, piece: Any) -> bool:
        """Looks at the last fit of the sine under way, and starts the next."""
        if self._pool is None or not _fits(run, piece):
            return False
        key, known = self._known
        if key != id(piece) or known is None:
            self._known = (id(piece), self._pool.submit(_fit, *_data(run, piece)))
            return False
        if not known.done():
            return False
        self._known = (key, None)
        if known.exception() is not None:
            return False  # a fit that fails is no reason to stop recording
        response, error = known.result()
        return error < ENOUGH * abs(response)

    def _tell(self, frequency: float, done: "Future[tuple[complex, float]]") -> None:
        if done.cancelled() or done.exception() is not None:
            return
        response, error = done.result()
        degrees = math.degrees(math.atan2(response.imag, response.real))
        share = math.degrees(error / abs(response))
        gain = f"{abs(response):.4g} ± {1.96 * error:.2g} rad/s/V"
        self.say(f"{frequency:.4g} Hz: {gain}, {degrees:.2f} ± {1.96 * share:.2g} deg")


def _fits(run: Any, piece: Any) -> bool:
    """Whether the piece is a sine of enough periods."""
    if piece.planned.kind != "sine" or len(piece) < 20:
        return False
    turns = float(run.slots[piece.planned.slot].header["frequency_Hz"]) * piece.tick[-1] * run.rig.period_s
    return turns >= PERIODS or piece.complete


def _data(run: Any, piece: Any) -> "tuple[float, float, float, int, np.ndarray, np.ndarray, np.ndarray]":
    """Frequency, period, radians per count, planned ticks, and copies of ticks, volts and counts."""
    import numpy as np

    rig = run.rig
    tick, duty, count = (np.array(column, dtype=np.int64) for column in (piece.tick, piece.duty, piece.count))
    frequency = float(run.slots[piece.planned.slot].header["frequency_Hz"])
    return (
        frequency,
        rig.period_s,
        2 * math.pi / rig.counts_per_rev,
        piece.planned.ticks,
        tick,
        duty * rig.volts_per_duty,
        count,
    )


def _fit(
    frequency: float,
    period: float,
    unit: float,
    ticks: int,
    tick: "np.ndarray",
    volts: "np.ndarray",
    count: "np.ndarray",
) -> tuple[complex, float]:
    """Response of the mean speed over each tick [rad/s/V], and its standard error.

    The start of the motion is left out for a quarter of the time, at most half a second: the pole is not known yet.
    """
    import numpy as np

    angle = 2 * np.pi * frequency * period * tick
    columns = np.stack([np.sin(angle), np.cos(angle), np.ones(len(tick)), tick / ticks - 0.5], axis=-1)
    kept = tick >= min(tick[-1] // 4, round(0.5 / period))
    columns, values = columns[kept], np.stack([count - count[0], volts], axis=-1)[kept]
    inverse = np.linalg.inv(columns.T @ columns)
    coefficients = inverse @ (columns.T @ values)
    turn, drive = coefficients[0] + 1j * coefficients[1]
    square = ((values - columns @ coefficients)[:, 0] ** 2).sum()
    factor = unit * (np.exp(1j * 2 * np.pi * frequency * period) - 1) / period / drive
    variance = max(square / max(len(values) - 4, 1), 1 / 12)
    error = abs(factor) * math.sqrt(variance * float(np.trace(inverse[:2, :2])) / 2)
    return complex(turn * factor), float(error)


def _where(progress: Any, *, timed: bool = True) -> str:
    kind = progress.kind.replace("_", " ")
    left = f", {progress.total_s - progress.done_s:.0f} s left" if timed else ""
    return f"{progress.experiment + 1}/{progress.experiments} {kind}{left}, {progress.lost} samples lost"


def _summary(recording: Any, output: Path) -> str:
    from jaxmotor.recording import lost_ticks

    segments = recording.segments
    rows = sum(map(len, segments))
    lost = sum(map(lost_ticks, segments))
    return f"{output}: {rows} samples in {len(segments)} segments, one per {recording.period_s:g} s, {lost} lost"
