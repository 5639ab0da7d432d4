"""What an experiment asks of the bridge, tick by tick, as the board makes it: for simulations without a board.

The board's own tables and whole numbers may differ from these by a duty.
"""

import math
from collections.abc import Mapping

import numpy as np

from jaxmotor.bench._plan import Experiment, Plan, PlanError, Value

PRBS_TAPS = {5: 3, 6: 5, 7: 6, 9: 5, 10: 7, 11: 9, 15: 14}
"""By the order of the shift register: the bit that is fed back with the last one."""


def experiment_volts(plan: Plan, index: int, supply_V: float) -> np.ndarray:
    """(ticks,) voltages [V] of experiment `index` of `plan` before they are rounded to duties; a closed loop has none.

    **Raises:** `PlanError` where they exceed the supply, or a shift register of that order is not known.
    """
    experiment = plan.experiments[index]
    where = f"{plan.name}: experiment {index}"
    check_order(where, experiment)
    volts = _volts(experiment, plan.period_s)
    largest = float(np.abs(volts).max(initial=0.0))
    if experiment.kind == "multisine":
        return np.clip(volts, -supply_V, supply_V)
    if largest > supply_V * (1 + 1e-9):
        raise PlanError(
            f"{where}: {largest:.3g} V are more than the supply of {supply_V:.4g} V; lower it or raise the supply"
        )
    return volts


def check_order(where: str, experiment: Experiment) -> None:
    """**Raises:** `PlanError` where `experiment` is a PRBS of an order that has no shift register."""
    order = experiment.parameters.get("order")
    if experiment.kind == "prbs" and order not in PRBS_TAPS:
        raise PlanError(f"{where}: order = {order} is not one of {', '.join(map(str, PRBS_TAPS))}")


def _volts(experiment: Experiment, period_s: float) -> np.ndarray:
    p, ticks = experiment.parameters, experiment.ticks
    k = np.arange(ticks)
    match experiment.kind:
        case "step":
            return np.full(ticks, float(p["amplitude_V"]))
        case "ramp":
            return float(p["from_V"]) + (float(p["to_V"]) - float(p["from_V"])) * k / ticks
        case "sine":
            turns = float(p["frequency_Hz"]) * period_s * k
            return p["amplitude_V"] * np.sin(2 * math.pi * turns) + float(p["offset_V"])
        case "chirp":
            first, last = float(p["from_Hz"]) * period_s, float(p["to_Hz"]) * period_s
            return p["amplitude_V"] * np.sin(2 * math.pi * (first * k + (last - first) / ticks * k * (k - 1) / 2))
        case "multisine":
            tone = np.arange(int(p["tones"]))
            schroeder = -np.pi * tone * (tone + 1) / len(tone)
            turns = float(p["first_Hz"]) * period_s * np.outer(k, 1 + tone * int(p["stride"]))
            return p["amplitude_V"] * np.sin(2 * math.pi * turns + schroeder).sum(axis=1)
        case "prbs":
            return float(p["offset_V"]) + float(p["amplitude_V"]) * _signs(p, ticks)
    return np.zeros(ticks)  # a rest, and a closed loop


def _signs(p: Mapping[str, Value], ticks: int) -> np.ndarray:
    """(ticks,) 1 or -1: the shift register's bits, each held for some ticks."""
    order, hold = int(p["order"]), int(p["hold_ticks"])
    bits, signs = 2**order - 1, []
    for _ in range(-(-ticks // hold)):
        signs.append(1.0 if bits & 1 else -1.0)
        bit = (bits >> order - 1 ^ bits >> PRBS_TAPS[order] - 1) & 1
        bits = (bits << 1 | bit) & 2**order - 1
    return np.repeat(signs, hold)[:ticks]
