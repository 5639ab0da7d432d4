"""What an experiment asks of the bridge, tick by tick, as the board makes it: for simulations without a board.

The board's own tables and whole numbers may differ from these by a duty.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from jaxmotor.bench._plan import Experiment, Plan, PlanError, Value

PRBS_TAPS = {5: 3, 6: 5, 7: 6, 9: 5, 10: 7, 11: 9, 15: 14}
"""By the order of the shift register: the bit that is fed back with the last one."""
Parameters = Mapping[str, Value]


def experiment_volts(plan: Plan, index: int, supply_V: float) -> np.ndarray:
    """(ticks,) voltages [V] of experiment `index` of `plan` before they are rounded to duties; a closed loop has none.

    **Raises:** `PlanError` where they exceed the supply, or a shift register of that order is not known.
    """
    experiment = plan.experiments[index]
    where = f"{plan.name}: experiment {index}"
    volts = _SIGNALS[experiment.kind](where, experiment, plan.period_s)
    largest = float(np.abs(volts).max(initial=0.0))
    if experiment.kind == "multisine":
        return np.clip(volts, -supply_V, supply_V)
    if largest > supply_V * (1 + 1e-9):
        raise PlanError(
            f"{where}: {largest:.3g} V are more than the supply of {supply_V:.4g} V; lower it or raise the supply"
        )
    return volts


def _constant(key: str) -> Callable[[str, Experiment, float], np.ndarray]:
    return lambda where, e, period: np.full(e.ticks, float(e.parameters[key]))


def _rest(where: str, e: Experiment, period_s: float) -> np.ndarray:
    del where, period_s
    return np.zeros(e.ticks)


def _ramp(where: str, e: Experiment, period_s: float) -> np.ndarray:
    del where, period_s
    first, last = float(e.parameters["from_V"]), float(e.parameters["to_V"])
    return first + (last - first) * np.arange(e.ticks) / e.ticks


def _sine(where: str, e: Experiment, period_s: float) -> np.ndarray:
    del where
    p = e.parameters
    turns = float(p["frequency_Hz"]) * period_s * np.arange(e.ticks)
    return p["amplitude_V"] * np.sin(2 * math.pi * turns) + float(p["offset_V"])


def _chirp(where: str, e: Experiment, period_s: float) -> np.ndarray:
    del where
    p, k = e.parameters, np.arange(e.ticks)
    first, last = float(p["from_Hz"]) * period_s, float(p["to_Hz"]) * period_s
    return p["amplitude_V"] * np.sin(2 * math.pi * (first * k + (last - first) / e.ticks * k * (k - 1) / 2))


def _multisine(where: str, e: Experiment, period_s: float) -> np.ndarray:
    del where
    p, tones = e.parameters, int(e.parameters["tones"])
    tone = np.arange(tones)
    schroeder = -np.pi * tone * (tone + 1) / tones
    turns = float(p["first_Hz"]) * period_s * np.outer(np.arange(e.ticks), 1 + tone * int(p["stride"]))
    return p["amplitude_V"] * np.sin(2 * math.pi * turns + schroeder).sum(axis=1)


def _prbs(where: str, e: Experiment, period_s: float) -> np.ndarray:
    del period_s
    p = e.parameters
    order, hold = int(p["order"]), int(p["hold_ticks"])
    if order not in PRBS_TAPS:
        raise PlanError(f"{where}: order = {order} is not one of {', '.join(map(str, PRBS_TAPS))}")
    bits, signs = 2**order - 1, []
    for _ in range(-(-e.ticks // hold)):
        signs.append(1.0 if bits & 1 else -1.0)
        bit = (bits >> order - 1 ^ bits >> PRBS_TAPS[order] - 1) & 1
        bits = (bits << 1 | bit) & 2**order - 1
    return float(p["offset_V"]) + float(p["amplitude_V"]) * np.repeat(signs, hold)[: e.ticks]


_SIGNALS: dict[str, Callable[[str, Experiment, float], np.ndarray]] = {
    "rest": _rest,
    "closed_loop": _rest,
    "step": _constant("amplitude_V"),
    "ramp": _ramp,
    "sine": _sine,
    "chirp": _chirp,
    "multisine": _multisine,
    "prbs": _prbs,
}
