"""`jaxmotor encoder`: how finely an encoder shows the speed, the paper's Table 1 for any of them."""

import json
import math
from pathlib import Path
from typing import Annotated

import typer

from jaxmotor.cli._folder import make_folder

PERIODS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)


def encoder_command(
    counts_per_rev: Annotated[float, typer.Option(metavar="N", help="All edges, per turn of the output shaft.")],
    period: Annotated[list[float] | None, typer.Option(metavar="S", help="Sampling period; may be repeated.")] = None,
    speed: Annotated[list[float] | None, typer.Option(metavar="RAD/S", help="For the relative error.")] = None,
    rpm: Annotated[list[float] | None, typer.Option(metavar="RPM", help="The same, in rpm.")] = None,
    average: Annotated[int, typer.Option(metavar="M", help="Ticks that each speed is the mean of.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object instead of the table.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder for the figure.")] = None,
) -> None:
    """Print how finely an encoder shows the speed: the paper's Table 1 for any encoder, period and speed."""
    from jaxmotor.bench import resolution_table

    speeds = [*(speed or ()), *(value * math.pi / 30 for value in rpm or ())]
    rows = resolution_table(counts_per_rev, period or PERIODS_S, average)
    text = _json(counts_per_rev, rows, speeds) if as_json else _table(counts_per_rev, rows, speeds)
    if output is not None:
        written = _write_figure(counts_per_rev, rows, speeds, output)
        text += "" if as_json else "\n\n" + "\n".join(f"wrote {path}" for path in written)
    typer.echo(text)


def _table(counts_per_rev: float, rows, speeds: list[float]) -> str:
    ticks = rows[0].ticks
    over = "one tick" if ticks == 1 else f"{ticks} ticks"
    head = ["period", "one count", "", "std. dev.", "delay", *("error at" for _ in speeds)]
    units = ["ms", "rpm", "rad/s", "rad/s", "ms", *(f"{value:.4g} rad/s" for value in speeds)]
    cells = [
        [
            f"{1e3 * row.period_s:.4g}",
            _digits(row.resolution_rpm),
            _digits(row.resolution_rad_s),
            _digits(row.standard_deviation_rad_s),
            f"{1e3 * row.delay_s:.4g}",
            *(f"{_digits(100 * row.relative_error(value))} %" for value in speeds),
        ]
        for row in rows
    ]
    widths = [max(map(len, column)) for column in zip(head, units, *cells, strict=True)]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in (head, units, *cells)
    ]
    title = f"{counts_per_rev:g} counts per turn, speed from the counts of {over}"
    return "\n".join([title, "", *(line.rstrip() for line in lines)])


def _digits(value: float) -> str:
    """Three significant digits, without an exponent where that is short."""
    if not 1e-3 <= value < 1e5:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def _json(counts_per_rev: float, rows, speeds: list[float]) -> str:
    return json.dumps(
        {
            "format": 1,
            "counts_per_rev": counts_per_rev,
            "rows": [
                {
                    "period_s": row.period_s,
                    "window_ticks": row.ticks,
                    "resolution_rad_s": row.resolution_rad_s,
                    "resolution_rpm": row.resolution_rpm,
                    "standard_deviation_rad_s": row.standard_deviation_rad_s,
                    "delay_s": row.delay_s,
                    "relative_error": [{"speed_rad_s": value, "ratio": row.relative_error(value)} for value in speeds],
                }
                for row in rows
            ],
        }
    )


def _write_figure(counts_per_rev: float, rows, speeds: list[float], folder: Path) -> list[Path]:
    from jaxmotor.present import encoder, save

    figure = encoder(counts_per_rev, rows, speeds)
    make_folder(folder)
    paths = [folder / "encoder.png", folder / "encoder.svg"]
    for path in paths:
        save(figure, path)
    return paths
