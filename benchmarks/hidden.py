"""Blind recordings: random motors on random plans, with an effect hidden in the emulated bench's plant.

    make -C firmware plant && python benchmarks/hidden.py KIND SEED OUT.csv

KIND is an effect (`cogging`), two (`coulomb_friction+transport_delay`), one outside the vocabulary (`late_load`) or
`none`. The file says nothing of it. Between experiments the bridge brakes and nothing is logged; a segment is `at_rest`
where the count then stood still for the last 0.1 s, as the recorder has it: an offset or an outside torque keeps the
shaft turning.
"""

import dataclasses
import itertools
import sys
import zlib

import numpy as np
from testing.hidden_plans import Experiment, Loop, Rig, draw_plan, draw_rig
from testing.plant import BRAKE, COAST, Plant, Run

from jaxmotor.motor.effects import EFFECTS
from jaxmotor.recording import Recording, Segment, write

NOT_IN_PLANT = frozenset(
    ("cubic_drive", "dead_time", "cubic_drag", "sector_friction", "warming_friction", "bristle_friction")
)
"""Effects that the emulated bench's plant has not."""
SINGLE = tuple(name for name in EFFECTS if name not in NOT_IN_PLANT)
OUTSIDE = ("late_load", "outside_torque", "wandering_torque")
SAME = (
    {"voltage_offset", "load_torque"},
    {"coulomb_friction", "stiction"},
    {"shaft_compliance", "backlash"},
    {"electrical_pole", "sensor_lag"},
    {"electrical_pole", "transport_delay"},
    {"electrical_pole", "coast_drive"},
    {"dead_zone", "input_threshold"},
)
"""Pairs that are one thing, or nearly."""
STILL_S = 0.1
LONGER_REST_S = 0.5
Sizes = dict[str, float]


@dataclasses.dataclass(frozen=True)
class Hidden:
    """A recording and what is behind it."""

    recording: Recording
    truth: dict[str, Sizes]
    """Parameters by effect, as plant files name them; empty where nothing is hidden."""
    gain: float
    """[rad/s/V]"""
    pole: float
    """Of the rotor alone where a load hangs on a spring or behind a gap [rad/s]."""
    electrical_time_constant: float
    """[s]"""
    viscous_share: float
    """[1]"""


def draw(kinds: tuple[str, ...], seed: int, scale: float = 1.0) -> Hidden:
    """A motor with `kinds` hidden in it: none, one or two of `SINGLE`, or one of `OUTSIDE`.

    Motor, plan and the sizes at scale 1 follow from `kinds` and `seed`. `scale` > 0 shrinks the effect: its volts,
    ratio, time or gap; a saturation or a current limit moves towards the supply; `coast_drive` has no size.

    **Raises:** `ValueError` for other kinds.
    """
    _check_kinds(kinds)
    kinds = tuple(sorted(kinds))
    root = np.random.SeedSequence([seed, *(zlib.crc32(kind.encode()) for kind in kinds)])
    of_rig, of_plan, of_sizes = (np.random.default_rng(child) for child in root.spawn(3))
    rig = draw_rig(of_rig)
    plan = draw_plan(rig, of_plan)
    rests = np.maximum(of_plan.uniform(0.4, 0.8, len(plan)), 12 / rig.pole)
    seconds = sum(experiment.ticks for experiment in plan) * rig.period_s + float(rests.sum())
    truth = {kind: sizes(kind, rig, seconds, of_sizes, scale) for kind in kinds}
    lag = truth.get("electrical_pole", {}).get("time_constant_s", rig.electrical_time_constant)
    return Hidden(_record(rig, plan, rests, truth), truth, rig.gain, rig.pole, lag, rig.viscous_share)


def draw_pair(seed: int) -> Hidden:
    """A motor with `pair_of(seed)` hidden in it."""
    return draw(pair_of(seed), seed)


def pair_of(seed: int) -> tuple[str, str]:
    """Names of two different effects at random, none of `SAME`."""
    pairs = [pair for pair in itertools.combinations(SINGLE, 2) if set(pair) not in SAME]
    return pairs[int(np.random.default_rng(seed).integers(len(pairs)))]


def _check_kinds(kinds: tuple[str, ...]) -> None:
    unknown = [kind for kind in kinds if kind not in SINGLE + OUTSIDE]
    if unknown:
        raise ValueError(f"{unknown[0]} is not an effect; one of {', '.join(SINGLE + OUTSIDE)}")
    if len(kinds) > 2 or len(set(kinds)) < len(kinds) or (len(kinds) == 2 and set(kinds) & set(OUTSIDE)):
        raise ValueError(f"{'+'.join(kinds)}: give one or two different effects, or one from outside the vocabulary")
    if set(kinds) == {"shaft_compliance", "backlash"}:
        raise ValueError("shaft_compliance and backlash share one load in the plant; give one of them")


def sizes(kind: str, rig: Rig, seconds: float, rng: np.random.Generator, scale: float) -> Sizes:
    """Parameters of `kind` on `rig` in a recording of `seconds`."""
    supply = rig.supply_V

    def volts(low: float, high: float) -> float:
        """A share of the supply."""
        return scale * supply * rng.uniform(low, high)

    def limit(low: float, high: float) -> float:
        return supply * (1 - scale * (1 - rng.uniform(low, high)))

    def sign() -> float:
        return float(rng.choice([-1, 1]))

    def phase() -> float:
        return rng.uniform(0, 2 * np.pi)

    match kind:
        case "coulomb_friction":
            return {"volts_V": volts(0.02, 0.08)}
        case "stiction":
            low = volts(0.02, 0.05)
            static = low + volts(0.02, 0.05)
            return {"volts_V": low, "static_volts_V": static, "stribeck_speed_rad_s": rng.uniform(1, 4)}
        case "dead_zone" | "input_threshold":
            return {"volts_V": volts(0.02, 0.07)}
        case "transport_delay":
            return {"delay_s": scale * rng.uniform(0.35, 2.2) * rig.period_s}
        case "electrical_pole":
            own = rig.electrical_time_constant
            return {"time_constant_s": own + scale * (rng.uniform(2e-3, 6e-3) - own)}
        case "supply_sag":
            return {"ratio": scale * rng.uniform(0.12, 0.35)}
        case "supply_drift":
            return {"rate_per_s": scale * rng.uniform(0.04, 0.1) / seconds}
        case "direction_asymmetry":
            return {"ratio": scale * sign() * rng.uniform(0.02, 0.07)}
        case "voltage_offset" | "load_torque":
            return {"volts_V": sign() * volts(0.01, 0.03)}
        case "cogging":
            return {"volts_V": volts(0.025, 0.06), "cycles_per_rev": float(rng.integers(1, 9)), "phase_rad": phase()}
        case "encoder_eccentricity":
            amplitude = scale * rng.uniform(0.015, 0.05)
            return {"amplitude_rad": amplitude, "cycles_per_rev": float(rng.integers(1, 3)), "phase_rad": phase()}
        case "quadratic_drag":
            return {"volts_V_s2_rad2": volts(0.05, 0.15) / (0.8 * rig.top_speed) ** 2}
        case "voltage_saturation":
            return {"volts_V": limit(0.78, 0.92)}
        case "current_limit":
            return {"volts_V": limit(0.45, 0.7)}
        case "winding_heating":
            return {"rise_ratio": scale * rng.uniform(0.6, 2.5), "time_constant_s": rng.uniform(8, 40)}
        case "shaft_compliance":
            swing, damping = rng.uniform(10, min(30.0, 0.25 / rig.period_s)), rng.uniform(0.03, 0.15)
            return {"frequency_Hz": swing, "damping_ratio": damping, "inertia_ratio": scale * rng.uniform(0.2, 0.6)}
        case "backlash":
            return {"gap_rad": scale * rng.uniform(0.02, 0.08), "inertia_ratio": scale * rng.uniform(0.2, 0.6)}
        case "missed_counts":
            return {"ratio": scale * rng.uniform(0.03, 0.1), "speed_rad_s": rng.uniform(0.4, 0.7) * rig.top_speed}
        case "sensor_lag":
            return {"time_constant_s": scale * rng.uniform(3e-3, 10e-3)}
        case "late_load":
            return {"start_s": rng.uniform(1 / 3, 2 / 3) * seconds, "volts_V": sign() * volts(0.02, 0.06)}
        case "outside_torque":
            frequency = float(np.exp(rng.uniform(np.log(0.6), np.log(6))))
            return {"frequency_Hz": frequency, "volts_V": volts(0.02, 0.05), "phase_rad": phase()}
        case "wandering_torque":
            return {"volts_V": volts(0.02, 0.05), "time_constant_s": rng.uniform(1, 6)}
    return {}


def plant_file(rig: Rig, truth: dict[str, Sizes]) -> str:
    """The plant of `rig` with `truth` in it. The coast drive is not here: the bridge is asked for it, see `_record`."""
    tables: dict[str, Sizes] = {
        "motor": {
            "gain_rad_s_V": rig.gain,
            "pole_rad_s": rig.pole,
            "viscous_share": rig.viscous_share,
            "resistance_ohm": rig.resistance_ohm,
            "inductance_H": rig.electrical_time_constant * rig.resistance_ohm,
        },
        "battery": {"volts_V": rig.supply_V},
        "encoder": {"counts_per_rev": rig.counts_per_rev},
        "bench": {"seed": rig.start, "pwm_edges": 0},
    }
    tables |= {kind: values for kind, values in truth.items() if kind != "coast_drive"}
    return "".join(
        f"[{table}]\n" + "".join(f"{key} = {float(value)!r}\n" for key, value in values.items())
        for table, values in tables.items()
    )


def _record(rig: Rig, plan: list[Experiment], rests: np.ndarray, truth: dict[str, Sizes]) -> Recording:
    """All of `plan` after a rest each; rests brake, so that a coasting motor comes to rest too."""
    segments = []
    drive = COAST if "coast_drive" in truth else BRAKE
    with Plant(plant_file(rig, truth)) as plant:
        ticks = 0
        for experiment, pause in zip(plan, rests, strict=True):
            waited, still = _rest(plant, rig, float(pause))
            run = _run(plant, rig, experiment, drive)
            segments.append(_segment(rig, experiment, run, round((ticks + waited) * rig.period_s, 6), still))
            ticks += waited + experiment.ticks
    return Recording(
        tuple(segments),
        "hidden.csv",
        period_s=rig.period_s,
        counts_per_rev=rig.counts_per_rev,
        duty_full_scale=float(rig.full_scale),
        supply_V=rig.supply_V,
        drive="brake",
        duty_delay_s=0.0,
        header={"motor": "drawn at random"},
    )


def _rest(plant: Plant, rig: Rig, seconds: float) -> tuple[int, bool]:
    """Rest for `seconds`, and somewhat longer where the shaft still turns: ticks waited, and whether it stood still."""
    block, waited, still = rig.ticks(STILL_S), 0, False
    while waited * rig.period_s < seconds or (not still and waited * rig.period_s < seconds + LONGER_REST_S):
        count = plant.sequence(np.zeros(block, np.int32), period_s=rig.period_s, full_scale=rig.full_scale).count
        waited, still = waited + block, len({*count.tolist(), plant.count}) == 1
    return waited, still


def _run(plant: Plant, rig: Rig, experiment: Experiment, drive: int) -> Run:
    if isinstance(experiment.drive, Loop):
        return plant.loop(*experiment.drive, period_s=rig.period_s, drive=drive, full_scale=rig.full_scale)
    return plant.sequence(experiment.drive, period_s=rig.period_s, drive=drive, full_scale=rig.full_scale)


def _segment(rig: Rig, experiment: Experiment, run: Run, start_s: float, at_rest: bool) -> Segment:
    tick, duty = np.arange(experiment.ticks), run.duty.astype(np.int64)
    volts = duty / rig.full_scale * rig.supply_V
    parameters = dict(experiment.parameters)
    return Segment(
        experiment.kind, start_s, at_rest, parameters, tick * rig.period_s, volts, tick=tick, duty=duty, count=run.count
    )


def main() -> None:
    if len(sys.argv) != 4 or not sys.argv[2].isdecimal():
        sys.exit(f"usage: python {sys.argv[0]} KIND SEED OUT.csv    (KIND: none, an effect, or two joined by +)")
    kind, seed, path = sys.argv[1:]
    try:
        hidden = draw(() if kind == "none" else tuple(kind.split("+")), int(seed))
    except ValueError as error:
        sys.exit(str(error))
    write(hidden.recording, path)


if __name__ == "__main__":
    main()
