"""A second plant, written apart from the project's: winding, rotor, load, bristles and heat, integrated in numpy.

State of each motor, all of it at the output shaft: current [A], rotor speed [rad/s] and angle [rad], load speed and
angle, temperature rise of the winding [K], warmth of the grease [1], output of the log's filter [rad]. Classical
Runge-Kutta steps of `STEP_S` on the mean bridge voltage. Dry friction is Karnopp's: within a step it keeps its sign or
holds the rotor; a step in which the rotor stops or breaks away ends there. Many motors are stepped side by side.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

STEP_S = 2e-4
"""All times of a schedule are multiples of it."""
INFINITE = 1e30
STATES = ("current", "speed", "angle", "load_speed", "load_angle", "heat", "warmth", "filtered")
COPPER_PER_K = 3.93e-3
"""Temperature coefficient of copper's resistance at 20 C."""
PARTS = 6
"""Of one step, at most: between stops and starts."""
SHORTEST = 1e-3
"""Part of a step."""


@dataclasses.dataclass(frozen=True)
class Plant:
    """One motor and what is wrong with it. The defaults of all but the first six do nothing."""

    resistance_ohm: float
    inductance_H: float
    constant_V_s: float
    """Back-EMF [V s/rad], and torque [N m/A]."""
    inertia_kg_m2: float
    viscous_N_m_s: float
    supply_V: float
    # Between command and winding.
    delay_s: float = 0.0
    fall_per_s: float = 0.0
    dead_zone_V: float = 0.0
    threshold_V: float = 0.0
    clip_V: float = INFINITE
    asymmetry: float = 0.0
    cubic_per_V2: float = 0.0
    """u + c u^3."""
    jump_s: float = INFINITE
    jump_gain: float = 1.0
    """Of the bridge, from `jump_s` on."""
    offset_V: float = 0.0
    coast: float = 0.0
    source_ohm: float = 0.0
    limit_A: float = INFINITE
    dead_time_V: float = 0.0
    """Lost against the sign of the current."""
    ripple_A: float = 1.0
    """Current below which the pulses' ripple changes its sign, so that only a part of `dead_time_V` is lost."""
    # Torques.
    friction_N_m: float = 0.0
    static_N_m: float = 0.0
    """At rest; what is less than `friction_N_m` is that."""
    stribeck_rad_s: float = 1.0
    bristle_rad: float = 0.0
    """Deflection at which a LuGre bristle slips; 0: friction is rigid."""
    bristle_damping_s: float = 0.0
    """Torque of the bristle's own speed, as a time: sigma_1/sigma_0."""
    warming: float = 0.0
    """Share of the friction that is gone when the grease is warm."""
    warming_s: float = 1.0
    warming_rad_s: float = 1.0
    """Speed that keeps the grease warm."""
    sector_N_m: float = 0.0
    """Friction beside the other, in a sector of the turn."""
    sector_rad: float = 0.0
    sector_width_rad: float = 0.0
    drag_N_m_s2: float = 0.0
    cubic_drag_N_m_s3: float = 0.0
    detent_N_m: float = 0.0
    detent_cycles: float = 1.0
    detent_rad: float = 0.0
    load_N_m: float = 0.0
    arm_N_m: float = 0.0
    """Weight times length of an arm that hangs down at the angle 0."""
    heat_K_W: float = 0.0
    heat_s: float = 1.0
    inertia_jump_s: float = INFINITE
    inertia_jump: float = 1.0
    # The load behind a spring or a gap.
    load_kg_m2: float = 0.0
    spring_N_m_rad: float = 0.0
    damper_N_m_s: float = 0.0
    gap_rad: float = -1.0
    """Negative: the spring holds both ways."""
    # The sensor.
    lost_share: float = 0.0
    lost_above_rad_s: float = INFINITE
    eccentric_rad: float = 0.0
    eccentric_cycles: float = 1.0
    eccentric_phase_rad: float = 0.0
    filter_s: float = 0.0

    @property
    def gain(self) -> float:
        """Final speed of the linear motor [rad/s/V]."""
        return self.constant_V_s / (self.constant_V_s**2 + self.viscous_N_m_s * self.resistance_ohm)

    @property
    def pole(self) -> float:
        """Of the linear motor without inductance [rad/s]."""
        damping = self.constant_V_s**2 / self.resistance_ohm + self.viscous_N_m_s
        return damping / self.inertia_kg_m2

    @property
    def per_volt(self) -> float:
        """Torque of the rotor that stands still [N m/V]."""
        return self.constant_V_s / self.resistance_ohm


class Schedule(NamedTuple):
    """What the board does with one motor: at each of `at`, the shaft is read and then the bridge is set."""

    at: np.ndarray
    """(n,) int, increasing, in `STEP_S`."""
    volts: np.ndarray
    """(n,) commanded from then on, of the supply as it was when the recording began [V]."""
    driven: np.ndarray
    """(n,) bool, false in pauses: the bridge then brakes whatever its drive."""
    torque_N_m: np.ndarray
    """(n,) of a disturbance against positive motion."""


class Motion(NamedTuple):
    """At each instant of a schedule, before the bridge is set."""

    angle: np.ndarray
    """That the encoder is at [rad], lost counts, eccentricity and filter included."""
    shaft: np.ndarray
    """Of the rotor [rad]."""
    speed: np.ndarray
    current: np.ndarray


NAMES = tuple(field.name for field in dataclasses.fields(Plant))
NEUTRAL = {field.name: field.default for field in dataclasses.fields(Plant)}


class _Lanes:
    """Plants side by side: `lanes.resistance_ohm` is (m,)."""

    def __init__(self, values: np.ndarray, laws: frozenset[str]):
        self.values, self.laws = values, laws
        for name, row in zip(NAMES, values, strict=True):
            setattr(self, name, row)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)

    def at(self, index: np.ndarray) -> "_Lanes":
        return _Lanes(self.values[:, index], self.laws)

    def has(self, *names: str) -> bool:
        """Some motor has one of these laws."""
        return not self.laws.isdisjoint(names)


class _Mode(NamedTuple):
    """What does not change within a part of a step; (m,) each."""

    way: np.ndarray
    """Of the motion, which friction opposes."""
    held: np.ndarray
    """The rotor stands still in its friction."""
    limited: np.ndarray
    """The bridge holds the current."""


class _Inputs(NamedTuple):
    """Held over a step; (m,) each."""

    volts: np.ndarray
    driven: np.ndarray
    torque: np.ndarray


def lanes_of(plants: Sequence[Plant]) -> _Lanes:
    values = np.array([[getattr(plant, name) for plant in plants] for name in NAMES], float)
    used = {name for name, row in zip(NAMES, values, strict=True) if NEUTRAL[name] not in row or np.ptp(row) > 0}
    return _Lanes(values, frozenset(used))


def simulate(plants: Sequence[Plant], schedules: Sequence[Schedule], step_s: float = STEP_S) -> list[Motion]:
    """Motion of each plant under its schedule, from rest at the angle 0.

    `step_s`, at most `STEP_S` and a whole part of it, is for tests of accuracy.
    """
    parts = round(STEP_S / step_s)
    lanes, number = lanes_of(plants), len(plants)
    state = np.zeros((len(STATES), number))
    lost = np.zeros(number)
    inputs = _Inputs(np.zeros(number), np.zeros(number, bool), np.zeros(number))
    read, sets = _events(plants, schedules)
    asked = [np.concatenate([getattr(one, name) for one in schedules]) for name in ("volts", "driven", "torque_N_m")]
    motion = Motion(*(np.empty(len(asked[0])) for _ in Motion._fields))
    bristle = np.zeros(number)
    stops = np.unique(np.concatenate([read.at, sets.at]))
    now = 0
    with np.errstate(over="ignore", under="ignore"):
        for stop in stops.tolist():
            for step in range(now * parts, stop * parts):
                before = state
                state, bristle = _step(lanes, state, bristle, inputs, step * step_s, step_s)
                if "lost_share" in lanes.laws:
                    lost = lost + _lost(lanes, before[1], state[1], step_s)
            now = stop
            _note(motion, read.take(stop), lanes, state, lost)
            lane, row = sets.take(stop)
            for values, all_values in zip(inputs, asked, strict=True):
                values[lane] = all_values[row]
    ends = np.cumsum([len(one.at) for one in schedules])[:-1]
    return [Motion(*parts) for parts in zip(*(np.split(values, ends) for values in motion), strict=True)]


class _Queue:
    """Lanes and rows (counted over all lanes) in the order of their time."""

    def __init__(self, at: np.ndarray, lane: np.ndarray):
        order = np.argsort(at, kind="stable")
        self.at, self.lane, self.row = at[order], lane[order], order
        self.done = 0

    def take(self, stop: int) -> tuple[np.ndarray, np.ndarray]:
        """Those of `stop`: lanes and rows."""
        end = self.done
        while end < len(self.at) and self.at[end] == stop:
            end += 1
        taken = slice(self.done, end)
        self.done = end
        return self.lane[taken], self.row[taken]


def _events(plants: Sequence[Plant], schedules: Sequence[Schedule]) -> tuple[_Queue, _Queue]:
    """When shafts are read, and when bridges are set."""
    lane = np.repeat(np.arange(len(schedules)), [len(one.at) for one in schedules])
    at = np.concatenate([one.at for one in schedules])
    late = np.rint(np.array([plant.delay_s for plant in plants]) / STEP_S).astype(int)
    # What is set after the last reading nobody sees.
    return _Queue(at, lane), _Queue(np.minimum(at + late[lane], at.max()), lane)


def _note(
    motion: Motion, which: tuple[np.ndarray, np.ndarray], lanes: _Lanes, state: np.ndarray, lost: np.ndarray
) -> None:
    lane, row = which
    shaft = state[2, lane]
    cycles, phase = lanes.eccentric_cycles[lane], lanes.eccentric_phase_rad[lane]
    angle = shaft - lost[lane] + lanes.eccentric_rad[lane] * np.sin(cycles * shaft + phase)
    motion.angle[row] = np.where(lanes.filter_s[lane] > 0, state[7, lane], angle)
    motion.shaft[row], motion.speed[row], motion.current[row] = shaft, state[1, lane], state[0, lane]


def _lost(lanes: _Lanes, before: np.ndarray, after: np.ndarray, step_s: float) -> np.ndarray:
    """Angle whose counts were lost in a step [rad]; the speed is taken to change evenly."""
    low, high = np.minimum(np.abs(before), np.abs(after)), np.maximum(np.abs(before), np.abs(after))
    above = np.clip((high - lanes.lost_above_rad_s) / np.maximum(high - low, 1e-12), 0.0, 1.0)
    mean = 0.5 * (np.maximum(low, lanes.lost_above_rad_s) + high)
    return lanes.lost_share * np.sign(before + after) * above * mean * step_s


def _step(
    lanes: _Lanes, state: np.ndarray, bristle: np.ndarray, inputs: _Inputs, time_s: float, step_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """State and bristles one step on."""
    volts = _commanded(lanes, inputs, time_s + 0.5 * step_s)
    pull = None
    if "bristle_rad" in lanes.laws:
        bristle, pull = _bristles(lanes, bristle, state, step_s)
    if not lanes.has("friction_N_m", "static_N_m", "sector_N_m", "limit_A"):
        return _runge_kutta(lanes, state, volts, inputs, pull, None, time_s, step_s), bristle
    return _stick_slip(lanes, state, volts, inputs, pull, time_s, step_s), bristle


def _stick_slip(
    lanes: _Lanes,
    state: np.ndarray,
    volts: np.ndarray,
    inputs: _Inputs,
    pull: np.ndarray | None,
    time_s: float,
    step_s: float,
) -> np.ndarray:
    """The state one step on, cut where a rotor stops or breaks away and where a current reaches its limit."""
    away = np.zeros(state.shape[1])
    after, left, away = _part(lanes, state, volts, inputs, pull, away, time_s, np.full(state.shape[1], step_s))
    for _ in range(PARTS):
        some = np.flatnonzero(left > 1e-9 * step_s)
        if len(some) == 0:
            break
        few = _Inputs(*(one[some] for one in inputs))
        pulled = None if pull is None else pull[some]
        part = _part(lanes.at(some), after[:, some], volts[some], few, pulled, away[some], time_s, left[some])
        after[:, some], left[some], away[some] = part
    return after


def _part(
    lanes: _Lanes,
    state: np.ndarray,
    volts: np.ndarray,
    inputs: _Inputs,
    pull: np.ndarray | None,
    away: np.ndarray,
    time_s: float,
    step: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State, time that is left of `step`, and the way in which a rotor breaks away, 0 where none does."""
    size = _dry(lanes, state)
    rigid = size > 0
    free = _free_torque(lanes, state, volts, inputs, pull)
    way = np.sign(state[1])
    still = (way == 0) & rigid
    way = np.where(still, np.where(np.abs(free) > size, np.sign(free), away), way)
    left = _winding(lanes, state, volts, inputs.driven)
    limited = (np.abs(state[0]) >= lanes.limit_A) & (left * state[0] > 0)
    mode = _Mode(way, still & (way == 0), limited)
    after = _runge_kutta(lanes, state, volts, inputs, pull, mode, time_s, step)
    stop = np.ones_like(step)
    stops = rigid & ~mode.held & (after[1] * way < 0)
    if stops.any():
        inertia = _inertia(lanes, time_s)
        stop[stops] = _root(way * state[1], (way * free - size) / inertia * step, way * after[1])[stops]
    leaves, away = mode.held, np.zeros_like(step)
    if leaves.any():
        then = _free_torque(lanes, after, volts, inputs, pull)
        leaves = mode.held & (np.abs(then) > size)
        away = np.where(leaves, np.sign(then), 0.0)
        size, free, then = size[leaves], np.abs(free[leaves]), np.abs(then[leaves])
        stop[leaves] = np.maximum((size - free) / (then - free), SHORTEST)
    limit = _limit_at(lanes, state, after, left, step, limited)
    share = np.minimum(stop, limit)
    cut = np.flatnonzero(stops | leaves | (limit < 1))
    if len(cut):
        few = _Inputs(*(one[cut] for one in inputs))
        pulled = None if pull is None else pull[cut]
        same = _Mode(*(one[cut] for one in mode))
        again = _runge_kutta(lanes.at(cut), state[:, cut], volts[cut], few, pulled, same, time_s, (share * step)[cut])
        at_rest = ((stops | leaves) & (stop <= limit))[cut]
        again[1, at_rest] = 0.0
        hits = (limit < stop)[cut]
        again[0, hits] = (np.sign(left) * lanes.limit_A)[cut][hits]
        away[limit < stop] = 0.0
        after[:, cut] = again
    return after, (1 - share) * step, away


def _limit_at(
    lanes: _Lanes, state: np.ndarray, after: np.ndarray, left: np.ndarray, step: np.ndarray, limited: np.ndarray
) -> np.ndarray:
    """Share of the step after which the current reaches its limit, at the speed that is now; 1 where it does not."""
    share = np.ones_like(step)
    if "limit_A" in lanes.laws:
        hits = (np.abs(after[0]) >= lanes.limit_A) & ~limited & (after[0] * left > 0)
        if hits.any():
            resistance, rises = lanes.resistance_ohm, np.abs(left)
            room = resistance * (lanes.limit_A - np.sign(left) * state[0])
            time = -lanes.inductance_H / resistance * np.log1p(-np.minimum(room / np.maximum(rises, 1e-300), 1 - 1e-9))
            share[hits] = np.clip(time / step, SHORTEST, 1 - SHORTEST)[hits]
    return share


def _root(begin: np.ndarray, slope: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Where in the step (0 to 1) a parabola from `begin` >= 0 with this first slope to `end` < 0 is zero."""
    curve = end - begin - slope
    root = np.sqrt(np.maximum(slope**2 - 4 * curve * begin, 0.0))
    return np.clip(2 * begin / np.maximum(root - slope, 1e-300), SHORTEST, 1.0)


def _commanded(lanes: _Lanes, inputs: _Inputs, time_s: float) -> np.ndarray:
    """Voltage that the bridge is to give [V], without what depends on the current."""
    volts = inputs.volts
    if "dead_zone_V" in lanes.laws:
        volts = np.sign(volts) * np.maximum(np.abs(volts) - lanes.dead_zone_V, 0.0)
    if "threshold_V" in lanes.laws:
        volts = np.where(np.abs(volts) >= lanes.threshold_V, volts, 0.0)
    if "cubic_per_V2" in lanes.laws:
        volts = volts + lanes.cubic_per_V2 * volts**3
    if "clip_V" in lanes.laws:
        volts = np.minimum(np.maximum(volts, -lanes.clip_V), lanes.clip_V)
    if "asymmetry" in lanes.laws:
        volts = (1 + lanes.asymmetry * np.sign(volts)) * volts
    if "jump_gain" in lanes.laws:
        volts = volts * np.where(time_s >= lanes.jump_s, lanes.jump_gain, 1.0)
    if "fall_per_s" in lanes.laws:
        volts = volts * (1 - lanes.fall_per_s * time_s)
    return volts + lanes.offset_V if "offset_V" in lanes.laws else volts


def _winding(lanes: _Lanes, state: np.ndarray, volts: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """Voltage that is left to change the current [V]."""
    current = state[0]
    resistance = lanes.resistance_ohm
    if "heat_K_W" in lanes.laws:
        resistance = resistance * (1 + COPPER_PER_K * state[5])
    if "source_ohm" in lanes.laws:
        resistance = resistance + lanes.source_ohm * (volts / lanes.supply_V) ** 2
    left = volts - resistance * current - lanes.constant_V_s * state[1]
    if "dead_time_V" in lanes.laws:
        left = left - lanes.dead_time_V * np.minimum(np.maximum(current / lanes.ripple_A, -1), 1) * driven
    return left


def _coasting(lanes: _Lanes, state: np.ndarray, volts: np.ndarray) -> np.ndarray:
    """Mean current of a bridge that is open between its pulses, of a winding whose current ends with each [A]."""
    duty, way = np.abs(volts) / lanes.supply_V, np.sign(volts)
    resistance = lanes.resistance_ohm * (1 + COPPER_PER_K * state[5]) + lanes.source_ohm * duty
    during = (way * lanes.supply_V - lanes.constant_V_s * state[1]) / resistance
    return duty * way * np.maximum(way * during, 0.0)


def _inertia(lanes: _Lanes, time_s: float) -> np.ndarray:
    if "inertia_jump" not in lanes.laws:
        return lanes.inertia_kg_m2
    return lanes.inertia_kg_m2 * np.where(time_s >= lanes.inertia_jump_s, lanes.inertia_jump, 1.0)


def _dry(lanes: _Lanes, state: np.ndarray) -> np.ndarray:
    """Size of the rigid dry friction, or what it holds at rest [N m]."""
    size = _curve(lanes, state)
    if "bristle_rad" in lanes.laws:
        size = np.where(lanes.bristle_rad > 0, 0.0, size)
    if "sector_N_m" in lanes.laws:
        into = np.mod(state[2] - lanes.sector_rad, 2 * np.pi)
        size = size + np.where(into < lanes.sector_width_rad, lanes.sector_N_m, 0.0)
    return size


def _curve(lanes: _Lanes, state: np.ndarray) -> np.ndarray:
    """Friction over speed [N m]."""
    size = lanes.friction_N_m
    if "static_N_m" in lanes.laws:
        more = np.maximum(lanes.static_N_m - size, 0.0)
        size = size + more * np.exp(-((state[1] / lanes.stribeck_rad_s) ** 2))
    if "warming" in lanes.laws:
        size = size * (1 - lanes.warming * state[6])
    return size


def _bristles(lanes: _Lanes, bristle: np.ndarray, state: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Deflections [rad] after a step at the speed that is now, and the mean torque of it against the motion [N m]."""
    speed = state[1]
    curve = _curve(lanes, state)
    slip = np.where(lanes.bristle_rad > 0, lanes.bristle_rad, 1.0)
    stiffness = np.where(lanes.bristle_rad > 0, lanes.friction_N_m / slip, 0.0)
    longest = curve / np.maximum(stiffness, 1e-30) * np.sign(speed)
    rate = np.abs(speed) * stiffness / np.maximum(curve, 1e-30)
    keep = np.exp(-rate * step_s)
    then = np.where(rate * step_s > 1e-9, longest + (bristle - longest) * keep, bristle + speed * step_s)
    mean = np.where(
        rate * step_s > 1e-6,
        longest + (bristle - longest) * (1 - keep) / np.maximum(rate * step_s, 1e-30),
        0.5 * (bristle + then),
    )
    own = lanes.bristle_damping_s * stiffness * (then - bristle) / step_s
    on = lanes.bristle_rad > 0
    return np.where(on, then, 0.0), np.where(on, stiffness * mean + own, 0.0)


def _free_torque(
    lanes: _Lanes, state: np.ndarray, volts: np.ndarray, inputs: _Inputs, pull: np.ndarray | None
) -> np.ndarray:
    """Torque on the rotor without rigid dry friction [N m]."""
    current = _mean_current(lanes, state, volts, inputs)
    return _torque_of(lanes, state, inputs, pull, current) - (
        _coupling(lanes, state) if "load_kg_m2" in lanes.laws else 0.0
    )


def _mean_current(lanes: _Lanes, state: np.ndarray, volts: np.ndarray, inputs: _Inputs) -> np.ndarray:
    """Of the winding [A]."""
    if "coast" not in lanes.laws:
        return state[0]
    return np.where((lanes.coast > 0) & inputs.driven, _coasting(lanes, state, volts), state[0])


def _torque_of(
    lanes: _Lanes, state: np.ndarray, inputs: _Inputs, pull: np.ndarray | None, current: np.ndarray
) -> np.ndarray:
    """Torque on the rotor [N m] but for rigid dry friction and a load behind a spring."""
    speed = state[1]
    torque = lanes.constant_V_s * current - lanes.viscous_N_m_s * speed - lanes.load_N_m - inputs.torque
    if pull is not None:
        torque = torque - pull
    if "drag_N_m_s2" in lanes.laws:
        torque = torque - lanes.drag_N_m_s2 * speed * np.abs(speed)
    if "cubic_drag_N_m_s3" in lanes.laws:
        torque = torque - lanes.cubic_drag_N_m_s3 * speed**3
    if "detent_N_m" in lanes.laws:
        torque = torque - lanes.detent_N_m * np.sin(lanes.detent_cycles * state[2] + lanes.detent_rad)
    if "arm_N_m" in lanes.laws:
        torque = torque - lanes.arm_N_m * np.sin(state[2])
    return torque


def _coupling(lanes: _Lanes, state: np.ndarray) -> np.ndarray:
    """Torque from the rotor to the load [N m]; at a gap's edges it pushes and never pulls."""
    twist, turning = state[2] - state[4], state[1] - state[3]
    if "gap_rad" not in lanes.laws:
        return lanes.spring_N_m_rad * twist + lanes.damper_N_m_s * turning
    half = 0.5 * np.maximum(lanes.gap_rad, 0.0)
    beyond = np.sign(twist) * np.maximum(np.abs(twist) - half, 0.0)
    torque = lanes.spring_N_m_rad * beyond + np.where(beyond != 0, lanes.damper_N_m_s * turning, 0.0)
    pushes = np.where(torque * beyond > 0, torque, 0.0)
    return np.where(lanes.gap_rad >= 0, pushes, torque)


def _rates(
    lanes: _Lanes,
    state: np.ndarray,
    volts: np.ndarray,
    inputs: _Inputs,
    pull: np.ndarray | None,
    mode: _Mode | None,
    time_s: float,
) -> np.ndarray:
    """(8, m) derivative of the state."""
    rates = np.zeros_like(state)
    rates[0] = _winding(lanes, state, volts, inputs.driven) / lanes.inductance_H
    current = _mean_current(lanes, state, volts, inputs)
    torque = _torque_of(lanes, state, inputs, pull, current)
    if "load_kg_m2" in lanes.laws:
        push = _coupling(lanes, state)
        torque = torque - push
        rates[3], rates[4] = push / np.maximum(lanes.load_kg_m2, 1e-30), state[3]
    if mode is not None:
        rates[0] = np.where(mode.limited, 0.0, rates[0])
        torque = np.where(mode.held, 0.0, torque - mode.way * _dry(lanes, state))
    rates[1] = torque / _inertia(lanes, time_s)
    rates[2] = state[1]
    if "heat_K_W" in lanes.laws:
        power = current**2 * lanes.resistance_ohm * (1 + COPPER_PER_K * state[5])
        rates[5] = (lanes.heat_K_W * power - state[5]) / lanes.heat_s
    if "warming" in lanes.laws:
        rates[6] = (np.minimum(np.abs(state[1]) / lanes.warming_rad_s, 1.0) - state[6]) / lanes.warming_s
    if "filter_s" in lanes.laws:
        seen = state[2] + lanes.eccentric_rad * np.sin(lanes.eccentric_cycles * state[2] + lanes.eccentric_phase_rad)
        rates[7] = (seen - state[7]) / np.where(lanes.filter_s > 0, lanes.filter_s, 1.0)
    return rates


def _runge_kutta(
    lanes: _Lanes,
    state: np.ndarray,
    volts: np.ndarray,
    inputs: _Inputs,
    pull: np.ndarray | None,
    mode: _Mode | None,
    time_s: float,
    step: np.ndarray | float,
) -> np.ndarray:
    """The state a `step` [s] on, of friction that keeps its way."""
    first = _rates(lanes, state, volts, inputs, pull, mode, time_s)
    second = _rates(lanes, state + 0.5 * step * first, volts, inputs, pull, mode, time_s)
    third = _rates(lanes, state + 0.5 * step * second, volts, inputs, pull, mode, time_s)
    fourth = _rates(lanes, state + step * third, volts, inputs, pull, mode, time_s)
    after = state + step / 6 * (first + 2 * (second + third) + fourth)
    if "limit_A" in lanes.laws:
        after[0] = np.minimum(np.maximum(after[0], -lanes.limit_A), lanes.limit_A)
    if mode is not None:
        after[1, mode.held] = 0.0
    if "coast" in lanes.laws:
        # A bridge that opens leaves no current, nor does one that begins to brake find any.
        after[0] = np.where((lanes.coast > 0) & inputs.driven, 0.0, after[0])
    return after
