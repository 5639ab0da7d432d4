"""Free simulation of 22 x 1200 ticks with Coulomb friction and a dead zone, against the same loop in C.

The C loop is the same law, exact over each tick, one lane after the other, and takes a logarithm only where a motor
stops; compiled by `cc -O3 -march=native`. Ours steps through all lanes at once. Each has its volts as it reads them,
ticks or lanes side by side. `simulate_motor`, which does the same for all effects in steps of a millisecond, stands
beside them. Times are taken in turn, so that what disturbs one disturbs all.
"""

import argparse
import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from fleet_sines import interleaved

from jaxmotor._runtime import keep_programs
from jaxmotor.fleet import simulate_friction
from jaxmotor.motor import FirstOrder, Motor, Rows, simulate_motor
from jaxmotor.motor.effects import CoulombFriction, DeadZone

SOURCE = r"""
#include <math.h>
void simulate(const double *volts, double *turn, long lanes, long ticks, double period, double gain, double pole,
              double friction, double dead)
{
    double kept = exp(-pole * period), coast = (1 - kept) / pole, rub = gain * friction;
    for (long lane = 0; lane < lanes; lane++) {
        double w = 0;
        for (long k = 0; k < ticks; k++) {
            double u = volts[lane * ticks + k], size = fabs(u) - dead, target = size > 0 ? gain * copysign(size, u) : 0;
            double from_rest = fabs(target) > rub ? target - copysign(rub, target) : 0;
            double v = w == 0 ? from_rest : target - copysign(rub, w), end = v + (w - v) * kept;
            if (w * end < 0) {
                double ratio = -w / v, moving = log1p(ratio) / pole, left = 1 - kept * (1 + ratio);
                turn[lane * ticks + k] = v * moving + w / pole + from_rest * (period - moving - left / pole);
                w = from_rest * left;
            } else {
                turn[lane * ticks + k] = v * period + (w - v) * coast;
                w = end;
            }
        }
    }
}
"""
GAIN, POLE, FRICTION_V, DEAD_V, PERIOD_S, SUPPLY_V = 11.0, 40.0, 0.3, 0.1, 0.005, 7.4


def compiled(folder: Path) -> ctypes.CDLL:
    (folder / "loop.c").write_text(SOURCE)
    command = ["cc", "-O3", "-march=native", "-ffast-math", "-shared", "-fPIC", "-o", folder / "loop.so"]
    subprocess.run([*command, folder / "loop.c", "-lm"], check=True)
    return ctypes.CDLL(str(folder / "loop.so"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lanes", type=int, default=22)
    parser.add_argument("--ticks", type=int, default=1200)
    parser.add_argument("--rounds", type=int, default=200)
    given = parser.parse_args()
    if shutil.which("cc") is None:
        raise SystemExit("no C compiler (cc) to compare with")
    keep_programs(threads=True)
    rng = np.random.default_rng(0)
    volts = 5 * np.sin(np.cumsum(rng.uniform(0.02, 0.1, (given.lanes, given.ticks)), axis=1))
    with tempfile.TemporaryDirectory() as name, jax.enable_x64(True):
        loop = compiled(Path(name)).simulate
        turn = np.empty_like(volts)
        pointers = (volts.ctypes.data_as(ctypes.c_void_p), turn.ctypes.data_as(ctypes.c_void_p))
        longs = [ctypes.c_long(n) for n in volts.shape]
        doubles = [ctypes.c_double(x) for x in (PERIOD_S, GAIN, POLE, FRICTION_V, DEAD_V)]
        parameters = jnp.asarray([GAIN, POLE, FRICTION_V, DEAD_V])
        held = jnp.asarray(volts.T)
        functions = {
            "C": lambda: loop(*pointers, *longs, *doubles),
            "jaxmotor": lambda: simulated(parameters, held),
            "with Jacobian": lambda: jacobian(parameters, held),
            "simulate_motor": lambda: general(parameters, held),
        }
        apart = np.abs(np.asarray(functions["jaxmotor"]()).T - (functions["C"](), turn)[1]).max() / np.abs(turn).max()
        for function in functions.values():
            function()
        times = interleaved(functions, given.rounds)
        print(f"{given.lanes} x {given.ticks} ticks; largest difference from C {apart:.1e}")
        for what, seconds in times.items():
            print(f"  {what:14s} {1e3 * seconds:8.3f} ms  {seconds / times['C']:6.2f} x C")
        ratio = times["with Jacobian"] / times["jaxmotor"]
        print(f"  four derivatives and the simulation cost {ratio:.2f} simulations")


@jax.jit
def simulated(parameters: jax.Array, volts: jax.Array) -> jax.Array:
    gain, pole, friction, dead = parameters
    reset = jnp.zeros(volts.shape, bool).at[0].set(True)
    still = jnp.zeros_like(volts)
    return simulate_friction(FirstOrder(gain, pole), friction, dead, volts, reset, still, jnp.asarray(PERIOD_S)).turn


@jax.jit
def general(parameters: jax.Array, volts: jax.Array) -> jax.Array:
    gain, pole, friction, dead = parameters
    motor = Motor(FirstOrder(gain, pole), (CoulombFriction(friction), DeadZone(dead)), jnp.zeros(()))
    reset = jnp.zeros(volts.shape[0], bool).at[0].set(True)
    still = jnp.zeros(volts.shape[0])

    def one(sequence: jax.Array) -> jax.Array:
        rows = Rows(sequence, reset, still, still)
        return simulate_motor(motor, rows, jnp.asarray(PERIOD_S), jnp.asarray(SUPPLY_V), 5).turn

    return jax.vmap(one, 1)(volts)


@jax.jit
def jacobian(parameters: jax.Array, volts: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The simulation (row, lane), and its derivatives (row, parameter, lane) by each parameter."""

    def along(direction: jax.Array) -> tuple[jax.Array, jax.Array]:
        return jax.jvp(lambda parameters: simulated(parameters, volts), (parameters,), (direction,))

    return jax.vmap(along, out_axes=(None, 1))(jnp.eye(len(parameters)))


if __name__ == "__main__":
    main()
