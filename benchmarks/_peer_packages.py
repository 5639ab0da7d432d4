"""Packages that jaxmotor does not depend on, run by a Python that has them: `python _peer_packages.py NAME FILE.npz...`
prints one line of JSON for each recording, [gain, pole, friction, seconds of the processor].

Recordings have many segments. SysIdentPy and SIPPY take one: they are given the segments one after the other, which
spoils one row of some hundred. jax-sysid is given them with zero voltage for 12 time constants between, not scored.
"""

import contextlib
import importlib
import io
import json
import sys
import time
from collections.abc import Callable

import numpy as np
from _peer_records import Found, Record, from_discrete, load, mean_speeds


def sysidentpy(record: Record) -> Found:
    """ARX of the mean speed with the sign of the speed as a second input, least squares extended by the noise."""
    basis = importlib.import_module("sysidentpy.basis_function")
    selection = importlib.import_module("sysidentpy.model_structure_selection")
    estimation = importlib.import_module("sysidentpy.parameter_estimation")
    volts, speed, _ = mean_speeds(record)
    # Its inputs act a row later at the earliest: the voltage is given a row ahead, the sign as it is.
    inputs = np.stack([np.append(volts[1:], 0.0), np.sign(speed)], axis=1)
    model = selection.FROLS(
        order_selection=False,
        n_terms=5,
        ylag=1,
        xlag=[[1, 2], [1]],
        estimator=estimation.LeastSquares(unbiased=True, uiter=30),
        basis_function=basis.Polynomial(degree=1),
    )
    model.fit(X=inputs, y=speed[:, None])
    # Codes of terms: 0 the constant, 1001 y[k-1], 200i the first input, 300i the second.
    theta = {int(code[0]): float(value) for code, value in zip(model.final_model, np.ravel(model.theta), strict=True)}
    return from_discrete(theta[1001], theta[2001] + theta[2002], theta[3001], record.period_s)


def sippy_armax(record: Record) -> Found:
    return _sippy(record, "ARMAX", ARMAX_orders=[[1], [[2, 1]], [1], [[0, 0]]], ARMAX_mod="ILLS", max_iterations=100)


def sippy_n4sid(record: Record) -> Found:
    return _sippy(record, "N4SID", SS_fixed_order=1, SS_D_required=True)


def _sippy(record: Record, method: str, **options) -> Found:
    """With the sign of the speed as a second input."""
    sippy = importlib.import_module("sippy_unipi")
    volts, speed, _ = mean_speeds(record)
    ahead = method != "N4SID"
    shown = np.append(volts[1:], 0.0) if ahead else volts
    sign = np.sign(speed) if ahead else np.sign(np.append(0.0, speed[:-1]))
    found = sippy.system_identification(speed.copy(), np.stack([shown, sign]), method, **options)
    if ahead:
        # G has one common denominator z - p; numerators are in powers of z.
        numerators, denominator = found.G.num[0], np.asarray(found.G.den[0][0])
        root = np.roots(denominator)
        p = float(np.real(root[np.argmax(np.abs(root))]))
        gains = [float(np.real(np.polyval(each, 1.0) / np.polyval(denominator, 1.0))) for each in numerators]
    else:
        p = float(np.asarray(found.A)[0, 0])
        gains = (np.asarray(found.C) @ np.asarray(found.B) / (1 - p) + np.asarray(found.D))[0].tolist()
    return from_discrete(p, gains[0] * (1 - p), gains[1] * (1 - p), record.period_s)


def jax_sysid_linear(record: Record) -> Found:
    return _jax_sysid(record, friction=False)


def jax_sysid_friction(record: Record) -> Found:
    return _jax_sysid(record, friction=True)


def _jax_sysid(record: Record, friction: bool) -> Found:
    """Gain, pole and f tanh(w/ε) of a motor whose voltage is held, by Adam and L-BFGS on the simulated mean speed."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    models = importlib.import_module("jax_sysid.models")
    volts, speed, begins = mean_speeds(record)
    start = _least_squares(volts, speed, begins, record.period_s)
    rest = int(12 / start[1] / record.period_s)
    pieces, scored, measured = [], [], []
    for begin, end in zip(np.flatnonzero(begins), [*np.flatnonzero(begins)[1:], len(volts)], strict=True):
        for kept, values in ((pieces, volts), (measured, speed)):
            kept += [values[begin:end], np.zeros(rest)]
        scored += [np.ones(end - begin), np.zeros(rest)]
    u, y, mask = (np.concatenate(each)[:, None] for each in (pieces, measured, scored))
    top = float(np.abs(speed).max())
    period = record.period_s

    def unpack(params):
        gain, pole = start[0] * jnp.exp(params[0]), start[1] * jnp.exp(params[1])
        decay = jnp.exp(-pole * period)
        return gain, decay, (1 - decay) / (pole * period)

    def driven(x, u, params):
        volts = u[0]
        if friction:
            volts = volts - start[2] * jnp.exp(params[2]) * jnp.tanh(x[0] * top / (0.01 * top * jnp.exp(params[3])))
        return volts

    def state(x, u, params):
        gain, decay, _ = unpack(params)
        return jnp.array([decay * x[0] + gain * (1 - decay) * driven(x, u, params) / top])

    def output(x, u, params):
        gain, _, share = unpack(params)
        return jnp.array([share * x[0] + gain * (1 - share) * driven(x, u, params) / top])

    model = models.Model(1, 1, 1, state_fcn=state, output_fcn=output, Ts=period)
    model.init(params=[jnp.zeros(()) for _ in range(4 if friction else 2)], x0=jnp.zeros(1))
    weight = jnp.asarray(mask)
    model.loss(output_loss=lambda shown, y: jnp.sum(weight * (shown - y) ** 2), rho_th=0.0, rho_x0=1.0, train_x0=False)
    model.optimization(adam_epochs=200, adam_eta=0.01, lbfgs_epochs=1000, lbfgs_tol=1e-12, iprint=-1)
    model.fit(y / top, u)
    params = [float(value) for value in model.params]
    found = start[0] * np.exp(params[0]), start[1] * np.exp(params[1])
    return *found, start[2] * np.exp(params[2]) if friction else np.nan


def _least_squares(volts: np.ndarray, speed: np.ndarray, begins: np.ndarray, period_s: float) -> Found:
    """To start from."""
    rows = np.flatnonzero(~begins)
    table = np.stack([speed[rows - 1], volts[rows], volts[rows - 1], np.sign(speed[rows - 1])], axis=1)
    p, now, before, c = np.linalg.lstsq(table, speed[rows], rcond=None)[0].tolist()
    gain, pole, friction = from_discrete(p, now + before, c, period_s)
    return gain, pole, max(friction, 0.01)


PEERS: dict[str, tuple[str, Callable[[Record], Found]]] = {
    "sysidentpy": ("sysidentpy", sysidentpy),
    "sippy_armax": ("sippy_unipi", sippy_armax),
    "sippy_n4sid": ("sippy_unipi", sippy_n4sid),
    "jax_sysid_linear": ("jax_sysid", jax_sysid_linear),
    "jax_sysid_friction": ("jax_sysid", jax_sysid_friction),
}
"""By name: the module to import, and the estimate."""


def main() -> None:
    module, estimate = PEERS[sys.argv[1]]
    importlib.import_module(module)
    for path in sys.argv[2:]:
        record = load(path)
        begin = time.process_time()
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # some of them print
                found = [float(value) for value in estimate(record)]
        except Exception as error:  # a peer that fails on a recording is told of, and the others go on
            print(f"{sys.argv[1]}, {path}: {type(error).__name__}: {error}", file=sys.stderr)
            found = [float("nan")] * 3
        print(json.dumps([*found, time.process_time() - begin]), flush=True)


if __name__ == "__main__":
    main()
