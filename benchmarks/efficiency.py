"""How close the estimates come to the best possible, and how honest their standard errors are.

    python benchmarks/efficiency.py [--recordings 1500] [--processes 2]

Motors drawn at random (gain 5-16 rad/s/V, pole 12-80 rad/s) make recordings of eleven sines of 4 s and ten steps, at
5 ms and 617.4 counts per turn. The bound is Cramer and Rao's for positions with a uniform rounding error and a free
offset per segment:  F = 12 Σ_s J_sᵀ (1 - 11ᵀ/n_s) J_s  with J = d position/d(log K, log a) in counts.

    plain    off-round frequencies, steps of different heights: RMSE <= 1.05 bounds, 93.5-96.5 % of intervals hold
    wander   the same, and the position does a random walk of 0.03 counts² per tick: intervals must hold
    whole    whole hertz and equal steps, so that the encoder repeats itself: intervals must widen and hold

On the same `plain` recordings: the paper's method, and the regression of accelerations that WPILib's SysId does.
"""

import argparse
import functools
import multiprocessing
import os
import tempfile

import jax
import numpy as np
from testing.made import COUNTS, PERIOD, SUPPLY, motion, recording, sine, step

from jaxmotor.estimate import identify
from jaxmotor.recording import Recording

WANDER = 0.03


def draw(kind: str, seed: int) -> tuple[float, float, Recording]:
    """Gain, pole, and a recording of one random motor."""
    rng = np.random.default_rng([seed, {"plain": 0, "wander": 1, "whole": 2}[kind]])
    gain, pole = rng.uniform(5, 16), np.exp(rng.uniform(np.log(12), np.log(80)))
    if kind == "whole":
        runs = [sine(f) for f in (0.5, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10)] + [step(5.1, 200)] * 10
    else:
        frequencies = np.geomspace(0.5, 10, 11) * (1 + rng.uniform(-0.01, 0.01, 11))
        heights = np.linspace(2, 5.1, 10) * np.where(np.arange(10) % 2, 1, -1)
        runs = [sine(f) for f in frequencies] + [step(h) for h in heights]
    return gain, pole, recording(rng, gain, pole, wander=WANDER if kind == "wander" else 0.0, runs=runs)


def bound(gain: float, pole: float, recorded: Recording) -> np.ndarray:
    """Least standard deviation of (log K, log a) that an unbiased estimate can have."""
    information = np.zeros((2, 2))
    for segment in recorded.segments:
        columns = []
        for shift in ((1e-5, 0.0), (0.0, 1e-5)):
            ends = [
                np.cumsum(motion(segment.volts, gain * np.exp(s * shift[0]), pole * np.exp(s * shift[1]))[1])
                for s in (1, -1)
            ]
            position = np.concatenate([[0.0], (ends[0] - ends[1])[:-1]]) / 2e-5
            columns.append(position * COUNTS / (2 * np.pi))
        slope = np.stack(columns, axis=1)
        slope = slope - slope.mean(0)
        information += 12 * slope.T @ slope
    return np.sqrt(np.diag(np.linalg.inv(information)))


def acceleration_regression(recorded: Recording) -> tuple[float, float]:
    """Gain and pole as WPILib's SysId regresses them: (v[k+1] - v[k])/T = α v[k] + β u[k] + γ sgn(v[k]), then
    K = -β/α and a = -α. The speed is the difference to the previous count, rows at rest are left out."""
    rows = []
    for segment in recorded.segments:
        assert segment.count is not None
        speed = np.diff(segment.count) * 2 * np.pi / (COUNTS * PERIOD)
        acceleration = np.diff(speed) / PERIOD
        rows.append(np.stack([speed[:-1], segment.volts[1:-1], np.sign(speed[:-1]), acceleration], axis=1))
    table = np.concatenate(rows)
    table = table[np.abs(table[:, 0]) > 0]
    alpha, beta, _ = np.linalg.lstsq(table[:, :3], table[:, 3])[0]
    return -beta / alpha, -alpha


def one(kind: str, peers: bool, seed: int) -> np.ndarray:
    """Errors and standard errors of (log K, log a), the bound, and the peers' errors."""
    gain, pole, recorded = draw(kind, seed)
    fit = identify(recorded, seed=seed)
    error = np.log([float(fit.motor.gain) / gain, float(fit.motor.pole) / pole])
    stated = [float(fit.standard_error.gain) / gain, float(fit.standard_error.pole) / pole]
    told = any("repeats itself" in note for note in fit.notes)
    others = np.full(4, np.nan)
    if peers:
        paper = identify(recorded, method="paper").motor
        others[:2] = np.log([float(paper.gain) / gain, float(paper.pole) / pole])
        others[2:] = np.array(acceleration_regression(recorded)) / (gain, pole) - 1
    return np.concatenate([error, stated, bound(gain, pole, recorded), others, [told]])


def report(kind: str, table: np.ndarray) -> None:
    error, stated, least, others = table[:, :2], table[:, 2:4], table[:, 4:6], table[:, 6:10]
    ratio = np.sqrt(((error / least) ** 2).mean(0))
    inside = 100 * (np.abs(error) < 1.96 * stated).mean(0)
    beyond = 100 * (np.abs(error) > 3 * stated).mean(0)
    widen = np.median(stated / least, axis=0)
    print(
        f"{kind:8s} {len(table):5d}   {ratio[0]:8.3f} {ratio[1]:8.3f}   {inside[0]:6.1f} {inside[1]:6.1f}   "
        f"{beyond[0]:5.2f} {beyond[1]:5.2f}   {widen[0]:6.2f} {widen[1]:6.2f}   {100 * table[:, 10].mean():5.0f}"
    )
    for name, part in (("the paper's method", others[:, :2]), ("acceleration regression", others[:, 2:])):
        if np.isnan(part).all():
            continue
        times = np.sqrt(((part / least) ** 2).mean(0))
        median, worst = 100 * np.median(part, axis=0), 100 * np.abs(part).max(0)
        print(
            f"    {name:24s} RMSE over the bound {times[0]:.0f} / {times[1]:.0f}; median error {median[0]:+.2f} % / "
            f"{median[1]:+.1f} %, worst {worst[0]:.2f} % / {worst[1]:.1f} %"
        )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--recordings", type=int, default=1500)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    print(f"gain / pole; {COUNTS} counts per turn, {1e3 * PERIOD:g} ms, {SUPPLY} V")
    print("            of   RMSE over the bound   95 % hold      beyond 3 se   stated/bound    told")
    with multiprocessing.get_context("spawn").Pool(options.processes, initializer=quiet) as pool:
        for kind in ("plain", "wander", "whole"):
            job = functools.partial(one, kind, kind == "plain")
            report(kind, np.array(pool.map(job, range(options.recordings), chunksize=25)))


def quiet() -> None:
    """One thread a process; compiled programs are shared between them."""
    jax.config.update("jax_compilation_cache_dir", os.path.join(tempfile.gettempdir(), "jaxmotor-benchmarks"))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


if __name__ == "__main__":
    main()
