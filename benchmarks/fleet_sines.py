"""Sine fit, gain and pole of 2000 motors x 16 frequencies x 1000 ticks, against one sum over the data and against
fitting motor by motor: the paper's Nelder-Mead, and numpy's and scipy's least squares.

The peers fit what the paper fits: amplitude and phase of each sine, then gain and pole to the 16 responses. numpy and
scipy solve the very problem that is solved here, so that answers can be compared; Nelder-Mead is scipy's with its
defaults, and has the exact response of a count difference. Each peer's time is the mean over some motors of its
shortest of three. `--motors 200` makes it small.
"""

import argparse
import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares, minimize
from scipy.signal import lfilter
from testing.made import COUNTS, PERIOD, held, motion

from jaxmotor._runtime import keep_programs
from jaxmotor.fleet import fit_projected, fit_shared, project, shared_plan

FREQUENCIES_HZ = np.geomspace(0.5, 10, 16) * 1.0037
TICKS, AMPLITUDE_V = 1000, 5.1
TIME = np.arange(TICKS) * PERIOD
VOLTS = np.array([held(AMPLITUDE_V * np.sin(2 * np.pi * f * TIME)) for f in FREQUENCIES_HZ])
UNIT = 2 * np.pi / COUNTS


def fleet(motors: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gains, poles, and counts (frequency, motor, tick) as float32."""
    rng = np.random.default_rng(seed)
    gains, poles = rng.uniform(8, 14, motors), rng.uniform(25, 60, motors)
    counts = np.empty((len(FREQUENCIES_HZ), motors, TICKS), np.float32)
    for k, volts in enumerate(VOLTS):
        for m, (gain, pole) in enumerate(zip(gains, poles, strict=True)):
            angle = np.concatenate([[0.0], np.cumsum(motion(volts, gain, pole)[1])[:-1]])
            counts[k, m] = np.floor(angle / UNIT + rng.uniform())
    return gains, poles, counts


def best(function: Callable[[], object], rounds: int = 7) -> float:
    """Shortest time of `rounds` [s]."""
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        jax.block_until_ready(function())
        times.append(time.perf_counter() - begin)
    return min(times)


def interleaved(functions: dict[str, Callable[[], object]], rounds: int = 9) -> dict[str, float]:
    """Shortest time of each [s], taken in turn so that what disturbs one disturbs all."""
    times = dict.fromkeys(functions, np.inf)
    for _ in range(rounds):
        for name, function in functions.items():
            times[name] = min(times[name], best(function, 1))
    return times


def mean_speed(gain: float, pole: float) -> np.ndarray:
    """V(z) at the frequencies (exact response of the count difference)."""
    p = np.exp(-pole * PERIOD)
    g = (1 - p) / (pole * PERIOD)
    z = np.exp(2j * np.pi * FREQUENCIES_HZ * PERIOD)
    return gain * (1 - g) + g * gain * (1 - p) / (z - p)


def linear_start(response: np.ndarray) -> np.ndarray:
    z = np.exp(2j * np.pi * FREQUENCIES_HZ * PERIOD)
    columns, right = np.stack([response, z, np.ones_like(z)], axis=1), response * z
    both = np.concatenate([np.real(columns), np.imag(columns)])
    p, b1, b0 = np.linalg.lstsq(both, np.concatenate([np.real(right), np.imag(right)]))[0]
    return np.array([(b1 + b0) / (1 - p), -np.log(p) / PERIOD])


def of_phasor(position: np.ndarray, drive: np.ndarray) -> np.ndarray:
    z = np.exp(2j * np.pi * FREQUENCIES_HZ * PERIOD)
    return (z - 1) / PERIOD * UNIT * position / drive


ANGLE = 2 * np.pi * FREQUENCIES_HZ[:, None] * TIME
COLUMNS = np.stack([np.sin(ANGLE), np.cos(ANGLE), np.ones_like(ANGLE), np.broadcast_to(TIME, ANGLE.shape)], axis=-1)
INVERSE = np.linalg.inv(np.einsum("fnc,fnd->fcd", COLUMNS, COLUMNS))
PROJECT = np.einsum("fcd,fnd->fcn", INVERSE, COLUMNS)[:, :2]
WHITEN = np.linalg.inv(np.linalg.cholesky(INVERSE[:, :2, :2] / 12))
DRIVE = np.einsum("fcn,fn->fc", PROJECT, VOLTS) @ [1, 1j]


def from_rest(pole: float) -> np.ndarray:
    """Coefficients (frequency, 2) that the sine fit reads of a motor with gain 1 that starts from rest [counts]."""
    p = np.exp(-pole * PERIOD)
    g = (1 - p) / (pole * PERIOD)
    turn = PERIOD * (g * lfilter([0, 1 - p], [1, -p], VOLTS) + (1 - g) * VOLTS)
    return (PROJECT @ (np.cumsum(turn, axis=1) - turn)[..., None])[..., 0] / UNIT


def by_scipy(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """numpy's lstsq for each sine, then scipy's least_squares for gain and pole: the problem that is solved here."""
    read = np.array([np.linalg.lstsq(columns, row)[0][:2] for columns, row in zip(COLUMNS, counts, strict=True)])

    def residual(x: np.ndarray) -> np.ndarray:
        return np.einsum("fij,fj->fi", WHITEN, read - x[0] * from_rest(np.exp(x[1]))).ravel()

    gain, pole = linear_start(of_phasor(read @ [1, 1j], DRIVE))
    found = least_squares(residual, [gain, np.log(pole)], method="lm", xtol=1e-10, ftol=1e-10).x
    return read, np.array([found[0], np.exp(found[1])])


def by_simplex(counts: np.ndarray) -> tuple[float, np.ndarray]:
    """The paper's way (eq. 12-15): amplitude and phase of each speed, then gain and pole, each by Nelder-Mead.

    Its model of the response is V(z)/z here, what the difference to the previous count shows.
    """
    z = np.exp(2j * np.pi * FREQUENCIES_HZ * PERIOD)
    response = []
    for frequency, row in zip(FREQUENCIES_HZ, counts, strict=True):
        speed, sine = np.diff(row) * UNIT / PERIOD, 2 * np.pi * frequency * TIME[1:]
        start = [np.sqrt(2) * speed.std(), 0.0]
        cost = lambda x, s=speed, w=sine: ((s - x[0] * np.sin(w + x[1])) ** 2).sum()  # noqa: E731
        amplitude, phase = minimize(cost, start, method="Nelder-Mead").x
        response.append(amplitude * np.exp(1j * phase) / AMPLITUDE_V)
    read = np.array(response)
    cost = lambda x: (np.abs(read - mean_speed(x[0], abs(x[1])) / z) ** 2).sum()  # noqa: E731
    return 0.0, np.abs(minimize(cost, [5.0, 20.0], method="Nelder-Mead").x)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=2000)
    parser.add_argument("--peers", type=int, default=6, help="motors that the peers fit")
    given = parser.parse_args()
    keep_programs(threads=True)
    gains, poles, counts = fleet(given.motors)
    with jax.enable_x64(True):
        plan = shared_plan(FREQUENCIES_HZ, VOLTS, PERIOD, COUNTS)
        sines, finish, whole = jax.jit(project), jax.jit(fit_projected), jax.jit(fit_shared)
        data, double = jnp.asarray(counts), jnp.asarray(counts.astype(float))
        read = sines(plan, data)
        times = interleaved(
            {
                "numpy.sum": counts.sum,
                "sine fit": lambda: sines(plan, data),
                "sine fit, float64": lambda: sines(plan, double),
                "gain and pole": lambda: finish(plan, read),
                "both": lambda: whole(plan, data),
            }
        )
        found, exact = (jax.tree.map(np.asarray, whole(plan, each)) for each in (data, double))
    print(f"{given.motors} motors x {len(FREQUENCIES_HZ)} x {TICKS}, float32 ({counts.nbytes / 1e6:.0f} MB)")
    for name, seconds in times.items():
        print(f"  {name:20s} {1e3 * seconds:9.2f} ms   {seconds / times['numpy.sum']:6.2f} x numpy.sum")
    lost = np.abs(found.gain / exact.gain - 1).max(), np.abs(found.pole / exact.pole - 1).max()
    print(f"  float32 loses at most {lost[0]:.1e} of the gain, {lost[1]:.1e} of the pole;", end=" ")
    print(f"standard errors are {np.median(exact.gain_error):.1e}, {np.median(exact.pole_error):.1e}")
    off = np.sqrt(np.mean((found.gain / gains - 1) ** 2)), np.sqrt(np.mean((found.pole / poles - 1) ** 2))
    print(f"  error of all motors (rms): gain {off[0]:.1e}, pole {off[1]:.1e}")
    mine = times["both"] / given.motors
    print(f"per motor, sine fit + gain and pole: {1e6 * mine:.2f} us")
    for name, peer in (("numpy + scipy least squares", by_scipy), ("Nelder-Mead, the paper's", by_simplex)):
        chosen = np.arange(min(given.peers, given.motors))
        peer(counts[:, 0].astype(float))
        rows = [counts[:, m].astype(float) for m in chosen]
        answers = np.array([peer(row)[1] for row in rows])
        each = float(np.mean([best(lambda row=row, peer=peer: peer(row), 3) for row in rows]))
        ours = np.stack([found.gain, found.pole], axis=1)[chosen]
        apart, true = np.abs(answers / ours - 1).max(0), np.stack([gains, poles], axis=1)[chosen]
        error = np.sqrt(np.mean((answers / true - 1) ** 2, axis=0))
        print(f"  {name:28s} {1e3 * each:8.2f} ms, {each / mine:8.0f} x;", end=" ")
        print(f"apart from ours by {apart[0]:.1e}, {apart[1]:.1e}; its error {error[0]:.1e}, {error[1]:.1e}")


if __name__ == "__main__":
    main()
