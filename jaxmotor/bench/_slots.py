"""A plan in the board's whole numbers, and what these whole numbers are in SI."""

import dataclasses
import math
from collections.abc import Mapping, Sequence

from jaxmotor.bench._board import Board
from jaxmotor.bench._plan import LARGEST, SMALLEST, Experiment, Plan, PlanError, Value
from jaxmotor.bench._signals import check_order

LEVEL = 128
"""Levels per duty."""
PHASE = 2**32
REFERENCE_MAX = 16384
_WORDS = {"closed_loop": "loop"}
Header = dict[str, float | int]


@dataclasses.dataclass(frozen=True)
class Rig:
    """What volts and turns are in duty and counts."""

    board: Board
    period_ms: int
    supply_V: float
    counts_per_rev: float

    @property
    def period_s(self) -> float:
        """Of the samples [s]."""
        return self.period_ms / 1000

    @property
    def counts_per_tick(self) -> float:
        """At 1 rad/s."""
        return self.counts_per_rev * self.period_s / (2 * math.pi)

    @property
    def volts_per_duty(self) -> float:
        """[V]"""
        return self.supply_V / self.board.full_scale

    def level(self, volts: float) -> int:
        """In 1/128 duty."""
        return round(volts / self.volts_per_duty * LEVEL)

    def increment(self, frequency_Hz: float) -> int:
        """Phase per tick in 1/2^32 turn."""
        return round(frequency_Hz * self.period_s * PHASE)


@dataclasses.dataclass(frozen=True)
class Slot:
    """One experiment as the board is told it."""

    kind: str
    """The board's word."""
    rest: int
    ticks: int
    numbers: tuple[int, int, int]
    header: Mapping[str, float | int]
    """What the recording says of it: SI, as the whole numbers come out."""


@dataclasses.dataclass(frozen=True)
class Planned:
    """One segment that the board will log."""

    slot: int
    kind: str
    """As in a recording's `[[segment]]`."""
    ticks: int
    is_rest_before: bool = False
    """The rest before a slot's experiment."""


def rig_for(plan: Plan, board: Board) -> Rig:
    """The board as `plan` wants it.

    **Raises:** `PlanError` where plan and board do not fit.
    """
    if plan.period_ms > board.period_max_ms:
        raise PlanError(
            f"{plan.name}: period_ms = {plan.period_ms} is longer than the board's {board.period_max_ms} ms; shorten it"
        )
    supply = board.supply_V if plan.supply_V is None else plan.supply_V
    if supply <= 0 and plan.supply_V is None:
        raise PlanError(f"{plan.name}: the board measures no supply; switch it on, or state supply_V in the plan")
    counts = board.counts_per_rev if plan.counts_per_rev is None else plan.counts_per_rev
    for key, value in (("supply_V", supply), ("counts_per_rev", counts)):
        if not SMALLEST <= value <= LARGEST:
            raise PlanError(f"{plan.name}: {key} = {value:g} is not a positive number; state it as it is on the rig")
    return Rig(board, plan.period_ms, supply, counts)


def slots_for(plan: Plan, rig: Rig) -> tuple[Slot, ...]:
    """One slot per experiment of `plan`.

    **Raises:** `PlanError`, with the experiment and the limit that it exceeds.
    """
    return tuple(_slot(f"{plan.name}: experiment {i}", e, rig) for i, e in enumerate(plan.experiments))


def layout(slots: Sequence[Slot], kinds: Sequence[str]) -> tuple[Planned, ...]:
    """The segments of a run of `slots`, whose experiments are of `kinds`: rests are segments of their own."""
    planned = []
    for index, (slot, kind) in enumerate(zip(slots, kinds, strict=True)):
        planned += [Planned(index, "rest", slot.rest, True)] if slot.rest else []
        planned.append(Planned(index, kind, slot.ticks))
    return tuple(planned)


def _slot(where: str, experiment: Experiment, rig: Rig) -> Slot:
    p = experiment.parameters
    limit = rig.board.full_scale * LEVEL
    numbers, header = (
        _sweep(p, rig, experiment.ticks) if experiment.kind == "chirp" else _NUMBERS[experiment.kind](p, rig)
    )
    levels = _levels(experiment.kind, numbers)
    if any(abs(level) > limit for level in levels):
        volts = max(map(abs, levels)) * rig.volts_per_duty / LEVEL
        raise PlanError(
            f"{where}: {volts:.3g} V are more than the supply of {rig.supply_V:.4g} V; lower it or raise the supply"
        )
    _check(where, experiment, rig, numbers)
    _check_small(where, experiment, rig)
    word = _WORDS.get(experiment.kind, experiment.kind)
    return Slot(word, experiment.rest_ticks, experiment.ticks, numbers, header)


def _levels(kind: str, numbers: tuple[int, int, int]) -> tuple[int, ...]:
    _, b, c = numbers
    return {
        "sine": (abs(b) + abs(c),),
        "prbs": (abs(b) + abs(c),),
        "step": (b,),
        "ramp": (b, c),
        "chirp": (c,),
        "multisine": (b,),
    }.get(kind, ())


def _check(where: str, experiment: Experiment, rig: Rig, numbers: tuple[int, int, int]) -> None:
    p = experiment.parameters
    check_order(where, experiment)
    if experiment.kind == "prbs" and p["hold_ticks"] > 255:
        raise PlanError(f"{where}: hold_ticks = {p['hold_ticks']} is more than 255")
    if experiment.kind == "multisine" and (p["tones"] > rig.board.tones or p["stride"] > 127):
        raise PlanError(f"{where}: at most {rig.board.tones} tones, and a stride of at most 127")
    if experiment.kind == "closed_loop" and abs(numbers[1]) > REFERENCE_MAX:
        speed = REFERENCE_MAX / 16 / rig.counts_per_tick
        raise PlanError(f"{where}: reference_rad_s is beyond the board's {speed:.4g} rad/s at this period")
    gains = (numbers[0] & 0xFFFF, numbers[0] >> 16)
    if experiment.kind == "closed_loop" and (numbers[0] < 0 or max(gains) > 0xFFFF or _gain(p["gain"], rig) > 0xFFFF):
        most, integral = _volts(0xFFFF, rig), 1 / rig.period_s / _duty_per_count_s(rig)
        raise PlanError(f"{where}: gain is from 0 to {most:.4g} V s/rad, integral_gain from 0 to {integral:.4g} V/rad")


def _check_small(where: str, experiment: Experiment, rig: Rig) -> None:
    """**Raises:** `PlanError` where the board's whole numbers make nothing of a frequency or an amplitude."""
    for key, value in experiment.parameters.items():
        if key.endswith("_Hz") and rig.increment(value) == 0:
            raise PlanError(f"{where}: {key} = {value:g} is below the board's {1 / PHASE / rig.period_s:.3g} Hz")
        if key == "amplitude_V" and rig.level(value) == 0:
            raise PlanError(f"{where}: {key} = {value:g} is below the board's {rig.volts_per_duty / LEVEL:.3g} V")


def _gain(gain: float, rig: Rig) -> int:
    """Kp, in 1/256 duty per (count per tick)."""
    return round(256 * gain / rig.volts_per_duty / rig.counts_per_tick)


def _volts(kp: int, rig: Rig) -> float:
    return kp * rig.volts_per_duty * rig.counts_per_tick / 256


def _sine(p: Mapping[str, Value], rig: Rig) -> tuple[tuple[int, int, int], Header]:
    increment = rig.increment(p["frequency_Hz"])
    header: Header = {"frequency_Hz": increment / PHASE / rig.period_s, "amplitude_V": p["amplitude_V"]}
    header |= {"offset_V": p["offset_V"]} if p["offset_V"] else {}
    return (increment, rig.level(p["amplitude_V"]), rig.level(p["offset_V"])), header


def _multisine(p: Mapping[str, Value], rig: Rig) -> tuple[tuple[int, int, int], Header]:
    tones, stride = int(p["tones"]), int(p["stride"])
    first = rig.increment(p["first_Hz"])
    header: Header = {"first_Hz": first / PHASE / rig.period_s, "tones": tones, "stride": stride}
    return (first, rig.level(p["amplitude_V"]), tones + 256 * stride), header | {"amplitude_V": p["amplitude_V"]}


def _sweep(p: Mapping[str, Value], rig: Rig, ticks: int) -> tuple[tuple[int, int, int], Header]:
    first, last = rig.increment(p["from_Hz"]), rig.increment(p["to_Hz"])
    change = round((last - first) / ticks)
    header: Header = {key: p[key] for key in ("from_Hz", "to_Hz", "amplitude_V")}
    return (first, change, rig.level(p["amplitude_V"])), header


def _prbs(p: Mapping[str, Value], rig: Rig) -> tuple[tuple[int, int, int], Header]:
    order, hold = int(p["order"]), int(p["hold_ticks"])
    header: Header = {"amplitude_V": p["amplitude_V"], "order": order, "hold_ticks": hold}
    header |= {"offset_V": p["offset_V"]} if p["offset_V"] else {}
    return (order + 256 * hold, rig.level(p["amplitude_V"]), rig.level(p["offset_V"])), header


def _loop(p: Mapping[str, Value], rig: Rig) -> tuple[tuple[int, int, int], Header]:
    kp, ki = _gain(p["gain"], rig), round(65536 * p["integral_gain"] * rig.period_s * _duty_per_count_s(rig))
    reference = round(16 * p["reference_rad_s"] * rig.counts_per_tick)
    header: Header = {"reference_rad_s": reference / 16 / rig.counts_per_tick, "gain": _volts(kp, rig)}
    if ki:
        header["integral_gain"] = ki / 65536 / rig.period_s / _duty_per_count_s(rig)
    return (kp + 65536 * ki, reference, 0), header


def _duty_per_count_s(rig: Rig) -> float:
    """Duty per count that an integral gain of 1 V/rad adds each second."""
    return 1 / rig.volts_per_duty / rig.counts_per_tick


_NUMBERS = {
    "sine": _sine,
    "multisine": _multisine,
    "prbs": _prbs,
    "step": lambda p, rig: ((0, rig.level(p["amplitude_V"]), 0), {"amplitude_V": p["amplitude_V"]}),
    "ramp": lambda p, rig: ((0, rig.level(p["from_V"]), rig.level(p["to_V"])), dict(p)),
    "closed_loop": _loop,
    "rest": lambda p, rig: ((0, 0, 0), {}),
}
