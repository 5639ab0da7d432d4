"""The exported C header on random motors: is what the loop does what was predicted?

    make firmware && python benchmarks/exported_loop.py [--motors 20] [--first 0] [--board] [--figure FILE]

Each motor has friction, dead zone and offset; its model is off as its stated errors say. The header's loop runs on the
motor, on the plant library or on the emulated board, and overshoot and steady error are held against the prediction.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from testing.exported import Drawn, Header, Plant, draw, on_board

from jaxmotor.control import Prediction, measure_step, predict_step, reachable_rad_s, speed_controller
from jaxmotor.present.exports import design, to_c

SECONDS = 1.5


def run(seed: int, folder: Path, board: bool, figure: Path | None = None) -> tuple[bool, str]:
    """Whether motor `seed` did what was predicted, and a line about it."""
    drawn = draw(seed)
    hardware = drawn.hardware
    made = design(drawn.model, hardware, kind="PI" if seed % 2 else "P")
    wanted = 0.6 * reachable_rad_s(drawn.model.whole, hardware.supply_V)
    sixteenths = round(16 * wanted * hardware.counts_per_tick)
    reference = sixteenths / 16 / hardware.counts_per_tick
    loop = speed_controller(drawn.model.whole, made.speed, hardware)
    predicted = predict_step(drawn.model, loop, hardware, reference, seconds=SECONDS)
    count = _counts(to_c(drawn.model, made), drawn, sixteenths, len(predicted.time_s), folder, board)
    shown = np.diff(count, prepend=count[0]) / hardware.counts_per_tick
    if figure is not None:
        draw_run(predicted, shown, reference, figure)
    overshoot, error = measure_step(shown, reference)
    over, steady = predicted.overshoot_percent, predicted.steady_error
    inside = (over.low <= overshoot <= over.high, steady.low <= error <= steady.high)
    text = (
        f"{seed:5d}  {made.speed.kind:2s} {made.speed.bandwidth_Hz:6.1f} {reference:9.2f}"
        f"  {overshoot:6.2f} [{over.low:6.2f}, {over.high:6.2f}]{' ' if inside[0] else '*'}"
        f"  {error:7.3f} [{steady.low:7.3f}, {steady.high:7.3f}]{' ' if inside[1] else '*'}"
    )
    return all(inside), text


def draw_run(predicted: Prediction, shown: np.ndarray, reference: float, file: Path) -> None:
    """The predicted band and the run, the first 0.4 s."""
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    ax = figure.subplots()
    ticks = predicted.time_s <= 0.4
    band = predicted.shown
    time = predicted.time_s[ticks]
    ax.fill_between(time, band.low[ticks], band.high[ticks], color="#0072B2", alpha=0.25, lw=0, label="predicted, 95 %")
    ax.plot(time, band.mean[ticks], color="#0072B2", label="mean of the prediction")
    ax.plot(time, shown[ticks], "o", color="black", markerfacecolor="white", markersize=3.5, label="run")
    ax.axhline(reference, color="black", linestyle=":", linewidth=0.9)
    ax.set(xlabel="Time (s)", ylabel="Speed from counts (rad/s)")
    ax.legend(frameon=False, loc="lower right")
    figure.savefig(file, dpi=150)


def _counts(header: str, drawn: Drawn, sixteenths: int, ticks: int, folder: Path, board: bool) -> np.ndarray:
    if board:
        return on_board(header, drawn, sixteenths, ticks, folder)[0]
    with Plant(drawn.toml) as plant:
        return Header(header, folder).speed_loop(plant, 16 * sixteenths, ticks, drawn.hardware)[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--figure", type=Path, help="draw the last motor's run here")
    parser.add_argument("--board", action="store_true", help="on the emulated board")
    options = parser.parse_args()
    print("motor      Hz  reference  overshoot [%], predicted       steady error [rad/s], predicted   (* outside)")
    good = 0
    for seed in range(options.first, options.first + options.motors):
        with tempfile.TemporaryDirectory() as folder:
            inside, text = run(seed, Path(folder), options.board, options.figure)
        good += inside
        print(text, flush=True)
    print(f"both within the predicted band: {good} of {options.motors}")


if __name__ == "__main__":
    main()
