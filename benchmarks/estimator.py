"""The speed estimator of the exported header on random motors, against the count difference.

    make firmware && python benchmarks/estimator.py

Each motor has friction, dead zone and offset, and a model that is off as its stated errors say; two sines drive it
through both directions. Errors are of the speed at the tick, root mean square over 4 s, against the plant's own.
"""

import tempfile
from pathlib import Path

import numpy as np
from testing.exported import Header, Plant, draw

from jaxmotor.present.exports import design, to_c

MOTORS, SECONDS = 20, 4.0


def errors(seed: int, folder: Path) -> tuple[float, float, float]:
    """[rad/s] of the estimator in C, of the count difference, and what the estimator states."""
    drawn = draw(seed)
    hardware = drawn.hardware
    made = design(drawn.model, hardware)
    header = Header(to_c(drawn.model, made), folder)
    time = np.arange(round(SECONDS / hardware.period_s)) * hardware.period_s
    duty = np.round(150 * np.sin(2 * np.pi * 1.003 * time) + 70 * np.sin(2 * np.pi * 3.1 * time)).astype(int)
    with Plant(drawn.toml) as plant:
        run = plant.sequence(duty, period_s=hardware.period_s, delay_s=hardware.delay_s)
    header.c.begin(header.estimate, int(run.count[0]))
    estimated = np.zeros(len(duty))
    for k, (count, one) in enumerate(zip(run.count, duty, strict=True)):
        estimated[k] = header.c.estimated(header.estimate, int(count)) / 65536 / hardware.counts_per_tick
        header.c.told(header.estimate, int(one))
    difference = np.diff(run.count, prepend=run.count[0]) / hardware.counts_per_tick
    own = [float(np.sqrt(np.mean((speed - run.speed) ** 2))) for speed in (estimated, difference)]
    return own[0], own[1], float(made.estimator.standard_deviation[0])


def main() -> None:
    print("motor  counts/rev  period   estimator  stated  count difference   (rad/s)")
    rows = []
    for seed in range(MOTORS):
        with tempfile.TemporaryDirectory() as folder:
            row = errors(seed, Path(folder))
        rows.append(row)
        hardware = draw(seed).hardware
        print(
            f"{seed:5d}  {hardware.counts_per_rev:10.1f}  {1e3 * hardware.period_s:3.0f} ms"
            f"  {row[0]:9.3f}  {row[2]:6.3f}  {row[1]:16.3f}"
        )
    estimated, difference, stated = np.array(rows).T
    print(
        f"median of difference/estimator: {np.median(difference / estimated):.1f} (worst "
        f"{(difference / estimated).min():.1f}); estimator/stated: median {np.median(estimated / stated):.2f}, "
        f"worst {(estimated / stated).max():.2f}"
    )


if __name__ == "__main__":
    main()
