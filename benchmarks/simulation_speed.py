"""The general simulation of motors with effects, against the same law as a scalar loop in C.

    python benchmarks/simulation_speed.py [--rounds 15]

16 000 ticks in 26 experiments, as a diagnosis simulates them: eight motors in one program, which also holds the
effects that are neutral in it, in steps of a millisecond, residuals filtered. The C loop takes the same steps of one
motor, one sequence after the other, and computes of the law only what its effects need; it is compiled by
`cc -O3 -march=native -ffast-math`, without the effects that are not there; so is the program `alone`, which long logs
have. Both are timed in turn, in seconds of the processor. A Jacobian is what a step of a fit
costs: the residual and its derivative by every free number. Goals: 2 x C, and 1.5 simulations for each column.
`uneven` is the shared program for rows of lengths of their own, up to a fifth apart, over that for even ones.
"""

import argparse
import ctypes
import dataclasses
import secrets
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from scipy.linalg import expm
from testing.made import recording, sine, step

from jaxmotor._precision import to_jax
from jaxmotor._programs import _quickly
from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis._free import free_of, linear_of, together
from jaxmotor.diagnosis._residuals import residuals_program
from jaxmotor.diagnosis._shared_program import as_shared
from jaxmotor.diagnosis._solve import Solver
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor import EFFECTS, Motor

SOURCE = r"""
#include <math.h>
#ifndef FRICTION
#define FRICTION 0
#endif
#ifndef COGGING
#define COGGING 0
#endif
#ifndef SAG
#define SAG 0
#endif
#ifndef DELAY
#define DELAY 0
#endif
typedef struct { double w, q, turn; } State;
typedef struct { double w, q, speed, current; } Moved;

/* rows of m: w, q after the step, mean w, mean q; columns: w, q, voltage, torque */
static inline Moved moved(const double *m, State s, double volts, double torque, double more)
{
    double current = m[12] * s.w + m[13] * s.q + m[15] * torque;
    double e = SAG ? (volts - more * current) / (1 + more * m[14]) : volts;
    return (Moved){m[0] * s.w + m[1] * s.q + m[2] * e + m[3] * torque,
                   m[4] * s.w + m[5] * s.q + m[6] * e + m[7] * torque,
                   m[8] * s.w + m[9] * s.q + m[10] * e + m[11] * torque, current + m[14] * e};
}

static inline State step(const double *m, double length, State s, double volts, double duty, double angle,
                         const double *effect)
{
    double rub = FRICTION ? effect[0] : 0, torque = COGGING ? effect[1] * sin(effect[2] * angle + effect[3]) : 0;
    double more = 0, way = (s.w > 0) - (s.w < 0);
    if (SAG) {
        double guess = moved(m, s, volts, torque + way * rub, 0).current;
        more = effect[4] * duty * duty * (duty * guess < 0 ? -1 : 1);
    }
    if (!FRICTION) {
        Moved end = moved(m, s, volts, torque, more);
        return (State){end.w, end.q, s.turn + end.speed * length};
    }
    Moved free = moved(m, s, volts, torque, more);
    if (way == 0) way = (free.w > 0) - (free.w < 0);
    Moved full = moved(m, s, volts, torque + way * rub, more);
    if (full.w * way >= 0) return (State){full.w, full.q, s.turn + full.speed * length};
    double budget = fabs(free.w - full.w), until = s.w / (s.w - full.w), pull = free.w - s.w;
    double on = (1 - until) * copysign(fmax(fabs(pull) - budget, 0), pull);
    double used = budget > 0 ? (free.w - on) / (budget * way) : 2 * until - 1;
    double moves = until + (1 - until) * fmax(1 - budget / fmax(fabs(pull), 1e-12), 0);
    double mean = 0.5 * (until * s.w + (1 - until) * on) + moves * (free.speed - 0.5 * (s.w + free.w));
    return (State){on, free.q + used * (full.q - free.q), s.turn + mean * length};
}

void simulate(const double *volts, const double *angle, const double *observed, const unsigned char *reset,
              const unsigned char *valid, double *filtered, long lanes, long room, long rows, long steps, double period,
              double supply, double unit, double memory, const double *effect, const double *old, const double *new_,
              long first, long whole, double part)
{
    double step_old = part * period / (DELAY ? first : steps);
    double step_new = DELAY ? (1 - part) * period / (steps + 1 - first) : period / steps;
    for (long lane = 0; lane < lanes; lane++) {
        const double *u = volts + lane * room, *a = angle + lane * room;
        State s = {0, 0, 0};
        double left = 0;
        long begin = 0;
        for (long k = 0; k < rows; k++) {
            long at = lane * room + k;
            if (reset[at]) { begin = k; s = (State){0, 0, 0}; }
            s.turn = 0;
            double late = k - whole - 1 >= begin ? u[k - whole - 1] : 0, now = k - whole >= begin ? u[k - whole] : 0;
            double turn = 0, bend = 0;
            if (COGGING) {
                int last = k + 1 == room || reset[at + 1], next = k + 2 < room ? reset[at + 2] : 1;
                turn = last ? 0 : a[k + 1] - a[k];
                if (!last && !reset[at] && !next) bend = 0.25 * ((a[k + 2] - a[k + 1]) - (a[k] - a[k - 1]));
            }
            if (DELAY)
                for (long j = 0; j < first; j++) {
                    double p = (j + 0.5) * step_old / period;
                    s = step(old, step_old, s, late, late / supply, a[k] + p * (turn - (1 - p) * bend), effect);
                }
            for (long j = 0; j < (DELAY ? steps + 1 - first : steps); j++) {
                double p = (DELAY ? part : 0) + (j + 0.5) * step_new / period;
                s = step(new_, step_new, s, now, now / supply, a[k] + p * (turn - (1 - p) * bend), effect);
            }
            int begins = reset[at] || k == 0 || !valid[at - 1];
            left = (valid[at] ? observed[at] - s.turn / unit : 0) + (begins ? 0 : memory * left);
            filtered[at] = left;
        }
    }
}
"""
GAIN, POLE, LAG_S, VISCOUS_SHARE = 11.0, 40.0, 6e-5, 0.05
SIZES = {
    "coulomb_friction": {"volts_V": 0.3},
    "transport_delay": {"delay_s": 3e-3},
    "cogging": {"volts_V": 0.2, "cycles_per_rev": 6.0, "phase_rad": 0.3},
    "supply_sag": {"ratio": 0.2},
}
FLAGS = {"coulomb_friction": "FRICTION", "cogging": "COGGING", "supply_sag": "SAG", "transport_delay": "DELAY"}
MOTORS = (
    ("coulomb_friction",),
    ("transport_delay",),
    ("cogging",),
    ("supply_sag",),
    ("coulomb_friction", "transport_delay"),
    ("coulomb_friction", "supply_sag"),
    ("coulomb_friction", "transport_delay", "cogging"),
    ("coulomb_friction", "supply_sag", "cogging"),
)


def motor_with(names: tuple[str, ...]) -> Motor:
    return linear_of(GAIN, POLE, LAG_S, VISCOUS_SHARE, tuple(EFFECTS[name].of(**SIZES[name]) for name in names))


def propagator(length: float) -> np.ndarray:
    """(w, q, voltage, torque) -> (w, q after `length` [s], mean w, mean q): w' = a (K q - |K| f) - a β w, τ q' = ..."""
    rate = np.zeros((6, 6))
    rate[0, :4] = [-POLE * VISCOUS_SHARE, POLE * GAIN, 0, -POLE * GAIN]
    rate[1, :3] = np.array([-(1 - VISCOUS_SHARE) / GAIN, -1, 1]) / LAG_S
    rate[4, 0] = rate[5, 1] = 1 / length
    return np.ascontiguousarray(expm(rate * length)[[0, 1, 4, 5], :4])


def in_c(folder: Path, names: tuple[str, ...], trial: Trial) -> tuple[Callable[[], object], np.ndarray]:
    """One simulation in C, and where it writes its filtered residuals (lane, row)."""
    source, library = folder / "simulate.c", folder / f"{'_'.join(names)}.so"
    source.write_text(SOURCE)
    flags = [f"-D{FLAGS[name]}=1" for name in names]
    command = ["cc", "-O3", "-march=native", "-ffast-math", "-shared", "-fPIC", *flags, "-o", library, source, "-lm"]
    subprocess.run(command, check=True)
    batch, period = trial.problem.batch, float(np.asarray(trial.problem.batch.duration))
    # A motor whose parts all move exactly needs one step for each voltage.
    steps = 1 if names == ("transport_delay",) else int(trial.steps)
    late = SIZES["transport_delay"]["delay_s"] / period if "transport_delay" in names else 0.0
    whole, part = divmod(late, 1.0)
    first = max(int(np.ceil(part * steps)), 1)
    number = steps + 1 - first if "transport_delay" in names else steps
    matrices = [propagator(max(part, 0.1) * period / first), propagator((1 - part) * period / number)]
    sizes = [SIZES["coulomb_friction"]["volts_V"], *SIZES["cogging"].values(), SIZES["supply_sag"]["ratio"]]
    filtered = np.zeros(trial.valid.shape)
    given = [np.ascontiguousarray(x, float) for x in (batch.volts, trial.angle, batch.observed)]
    given += [np.ascontiguousarray(x, np.uint8) for x in (batch.reset, batch.valid)]
    longs = [*trial.valid.shape, int(trial.used), steps]
    doubles = [period, float(trial.supply), float(trial.problem.unit), float(trial.memory)]
    tables = [np.array(sizes), *matrices]

    def pointers(arrays: list[np.ndarray]) -> list[ctypes.c_void_p]:
        return [ctypes.c_void_p(array.ctypes.data) for array in arrays]

    arguments = [*pointers([*given, filtered]), *map(ctypes.c_long, longs), *map(ctypes.c_double, doubles)]
    arguments += [*pointers(tables), ctypes.c_long(first), ctypes.c_long(int(whole)), ctypes.c_double(part)]
    loop, kept = ctypes.CDLL(str(library)).simulate, (given, tables)
    return lambda: (loop(*arguments), kept), filtered


def compiling(motors: Motor, speeds: np.ndarray, trial: Trial) -> tuple[float, float]:
    """Seconds of the processor to trace and lower the program, and to compile it."""
    arrays, static = eqx.partition((motors, speeds, trial), eqx.is_array)

    def fresh(arrays):
        return residuals_program.__wrapped__(*eqx.combine(arrays, static))  # pyright: ignore[reportFunctionMemberAccess]

    fresh.__name__ = f"fresh_{secrets.token_hex(8)}"  # under a name of its own no cache knows it
    begin = time.process_time()
    lowered = jax.jit(fresh, keep_unused=True).lower(arrays)
    middle = time.process_time()
    lowered.compile(compiler_options=_quickly())
    return middle - begin, time.process_time() - middle


def in_turn(functions: dict[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Seconds of the processor of each, `rounds` times."""
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, function in functions.items():
            begin = time.process_time()
            jax.block_until_ready(function())
            times[name].append(time.process_time() - begin)
    return times


def uneven(trial: Trial) -> Trial:
    """`trial` in rows of lengths of their own."""
    period, shape = float(np.asarray(trial.problem.batch.duration)), trial.valid.shape
    lasts = period * (1 + 0.2 * np.random.default_rng(0).uniform(-1, 1, shape))
    batch = trial.problem.batch._replace(duration=to_jax(lasts))
    longer = eqx.tree_at(lambda one: one.problem, trial, dataclasses.replace(trial.problem, batch=batch))
    lengths = to_jax(np.array([period, lasts.max()]))
    return eqx.tree_at(lambda one: one.lengths, longer, lengths, is_leaf=lambda leaf: leaf is None)


def measure(names: tuple[str, ...], solver: Solver, folder: Path, rounds: int) -> str:
    """A row of the table."""
    trial, motor = solver.trial, motor_with(names)
    free = free_of(motor)
    alone, speeds = together([motor] * solver.width), np.zeros((solver.width, solver.pieces))
    motors = as_shared(alone, solver.sharing)
    seconds = compiling(motors, speeds, trial)
    loop, filtered = in_c(folder, names, trial)
    functions = {
        "C": loop,
        "alone": lambda: residuals_program(alone, speeds, solver.given),
        "simulation": lambda: residuals_program(motors, speeds, solver.given),
        "uneven": lambda: residuals_program(motors, speeds, other),
        "jacobian": lambda: solver.linearise(motor, free, solver.starts),
    }
    other = uneven(solver.given)
    jax.block_until_ready(residuals_program(motors, speeds, other))
    ours = np.asarray(residuals_program(motors, speeds, solver.given)["drift"])[..., 0].T
    loop()
    apart = np.abs(ours - filtered)[trial.valid].max() / np.abs(filtered).max()
    times = in_turn(functions, rounds)
    each, own = ([t / solver.width for t in times[name]] for name in ("alone", "simulation"))
    ratios = [statistics.median(a / b for a, b in zip(one, times["C"], strict=True)) for one in (each, own)]
    columns = statistics.median(j / s / len(free) for j, s in zip(times["jacobian"], own, strict=True))
    longer = statistics.median(a / solver.width / b for a, b in zip(times["uneven"], own, strict=True))
    cells = [f"{1e3 * statistics.median(one):.2f}" for one in (times["C"], each, own)]
    cells += [
        *(f"{ratio:.2f}" for ratio in ratios),
        f"{longer:.2f}",
        f"{columns:.2f}",
        *(f"{one:.2f}" for one in seconds),
        f"{apart:.0e}",
    ]
    return f"| {' + '.join(names)} | " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    if shutil.which("cc") is None:
        raise SystemExit("no C compiler (cc) to compare with")
    keep_programs(threads=True)
    plan = [sine(f) for f in np.geomspace(0.5, 10, 16) * 1.0037] + [step(h, 320) for h in np.linspace(2, 5.1, 10)]
    made = recording(0, friction=0.3, runs=plan)
    print("| motor with | C, ms | alone, ms | shared, ms | x C | shared x C | uneven | simulations per column ", end="")
    print("| lower, s | compile, s | apart |\n|---|---|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name, jax.enable_x64(True):
        solver = study_of(made, POLE).solver
        for names in MOTORS:
            print(measure(names, solver, Path(name), rounds), flush=True)


if __name__ == "__main__":
    main()
