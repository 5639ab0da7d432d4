"""The estimator of `jaxmotor.control` in C: the same law in integers."""

from typing import NamedTuple

import numpy as np

from jaxmotor.control import Estimator, FeedForward, Hardware
from jaxmotor.present.exports._fixed_point import times, whole

MOST_COUNTS = 4096
"""Count difference in a tick."""
FULL = 2.0**30 - 2**17
"""Largest value of a state."""


def c_estimator(estimator: Estimator, hardware: Hardware) -> str:
    """C for `estimator`: states in 1/65536 of counts per tick, counts and duties."""
    states, late, law = _states(estimator, hardware), estimator.late, estimator.law
    return f"""\
{_structure(estimator, hardware, states)}
// A duty as a linear motor sees it [1/65536 duty].
static inline int32_t
motor_driven(int16_t duty)
{{
{_driven(law, hardware)}
}}

static inline void
motor_estimate_begin(struct motor_estimate *e, int32_t count)
{{
{_begin(states)}
    e->count = count;
    for (uint8_t k = 0; k < {late + 2}; ++k)
        e->driven[k] = motor_driven(0);
}}

// Take a latched count. Call it once in each period, before the duty is set.
static inline void
motor_estimate_count(struct motor_estimate *e, int32_t count)
{{
{_drives(late, _estimator_drag(law, hardware) + _advance(estimator, hardware, states))}
{_correct(estimator, states)}
    e->count = count;
}}

// The speed in 1/256 count per tick, for motor_speed_duty.
static inline int32_t
motor_estimate_speed(const struct motor_estimate *e)
{{
    return (e->speed + 128) >> 8;
}}

// Tell which duty was set. Call it once in each period, after the count.
static inline void
motor_estimate_duty(struct motor_estimate *e, int16_t duty)
{{
{_shift(late)}
    e->driven[0] = motor_driven(duty);
}}
"""


class _States(NamedTuple):
    """The filter's states in C, the motor's first, then the angle and the residual voltage."""

    names: tuple[str, ...]
    unit: np.ndarray
    """(n,) counts per tick, counts or duties that one rad/s, rad or V of a state is."""

    @property
    def angle(self) -> int:
        """Place of the angle."""
        return len(self.names) - 2


def _states(estimator: Estimator, hardware: Hardware) -> _States:
    order = len(np.asarray(estimator.transition)) - 2
    speed, angle, volts = hardware.counts_per_tick, 1 / hardware.count_rad, 1 / hardware.step_V
    return _States((*("speed", "torque")[:order], "ahead", "missing"), np.array([speed] * order + [angle, volts]))


def _structure(estimator: Estimator, hardware: Hardware, states: _States) -> str:
    deviation = float(np.asarray(estimator.standard_deviation)[0])
    second = "torque" in states.names
    torque = "    int32_t torque;   // as the speed that it would hold, 1/65536 count per tick\n" if second else ""
    return f"""\
// Speed, angle and residual voltage from counts: a steady Kalman filter, which knows encoder and friction.
// Standard deviation of the speed, as far as the model is right: {deviation:.3g} rad/s; a count difference has
// {hardware.speed_noise_rad_s:.3g} rad/s, and is half a tick late. Start it with motor_estimate_begin at rest.
struct motor_estimate {{
    int32_t speed;    // at the tick, 1/65536 count per tick
{torque}    int32_t ahead;    // shaft's angle beyond the middle of the latched count, 1/65536 count
    int32_t missing;  // residual voltage, 1/65536 duty
    int32_t count;    // latched
    int32_t driven[{estimator.late + 2}];  // duties as a linear motor sees them, the latest first, 1/65536 duty
}};
"""


def _advance(estimator: Estimator, hardware: Hardware, states: _States) -> str:
    """The states one tick later, as variables of their names; the residual voltage stays."""
    rows = range(states.angle + 1)
    lines = [f"    int32_t {states.names[row]} = {_row(estimator, hardware, states, row)};" for row in rows]
    return "\n".join([*lines, *_friction(estimator, states)])


def _row(estimator: Estimator, hardware: Hardware, states: _States, row: int) -> str:
    """What becomes of one state: a sum over the states and the duties."""
    transition, unit = np.asarray(estimator.transition)[row], states.unit
    # The angle keeps all of itself: it needs no product.
    terms = ["e->ahead"] if row == states.angle else []
    for k, name in enumerate(states.names):
        if row != states.angle or k != states.angle:
            terms += _term(f"e->{name}", transition[k] * unit[row] / unit[k])
    for drive, name in ((estimator.old_drive, "earlier"), (estimator.new_drive, "later")):
        terms += _term(name, float(np.asarray(drive)[row]) * unit[row] * hardware.step_V)
    return "\n        + ".join(terms)


def _begin(states: _States) -> str:
    return "\n".join(f"    e->{name} = 0;" for name in states.names)


def _drives(late: int, use: str) -> str:
    """The duties of the tick's two parts before the code that uses them; no name that C++ has a meaning for."""
    names = {"earlier": late + 1, "later": late}
    needed = [f"    int32_t {name} = e->driven[{place}];" for name, place in names.items() if name in use]
    return "\n".join([*needed, use])


def _term(name: str, scaled: float) -> list[str]:
    return [times(name, scaled, _room(scaled, FULL))] if scaled else []


def _friction(estimator: Estimator, states: _States) -> list[str]:
    speed, angle = states.unit[0], states.unit[states.angle]
    budget = 65536 * float(estimator.per_volt) * float(estimator.law.friction_V) * speed
    if not budget:
        return []
    share = float(estimator.turn_per_speed) * angle / speed
    return [
        "    // friction takes its full share, or stops the shaft",
        f"    int32_t lost = motor_clip(speed, {whole(abs(budget))});",
        "    speed -= lost;",
        f"    ahead -= {times('lost', share, FULL)};",
    ]


def _correct(estimator: Estimator, states: _States) -> str:
    """The states with what the count says of them."""
    gain = np.asarray(estimator.correction) * states.unit / states.unit[states.angle]
    # A larger error than this is a count that was missed, and is corrected over several ticks.
    most = 65536 * min(256.0, 2**13 / float(np.abs(gain).max()))
    before = (*states.names[:-1], "e->missing")
    return "\n".join(
        [
            f"    ahead -= motor_clip(count - e->count, {MOST_COUNTS}) * 65536;",
            f"    int32_t error = motor_clip(-ahead, {whole(most)});",
            *(
                f"    e->{name} = {old} + {times('error', gain[k], most)};"
                for k, (name, old) in enumerate(zip(states.names, before, strict=True))
            ),
        ]
    )


def _shift(late: int) -> str:
    return "\n".join(f"    e->driven[{k}] = e->driven[{k - 1}];" for k in range(late + 1, 0, -1))


def _room(scaled: float, full: float) -> float:
    """The largest value for which a product with `scaled` still fits."""
    return full if abs(scaled) < 1 else full / abs(scaled)


def _driven(law: FeedForward, hardware: Hardware) -> str:
    dead_zone = 65536 * float(law.dead_zone_V) / hardware.step_V
    constant = 65536 * (float(law.offset_V) - float(law.load_V)) / hardware.step_V
    asymmetry, most = float(law.asymmetry), 65536.0 * hardware.full_scale
    lines = ["    int32_t driven = duty * 65536;"]
    if dead_zone:
        zone = whole(dead_zone)
        lines.append(f"    driven = driven > {zone} ? driven - {zone} : driven < -{zone} ? driven + {zone} : 0;")
    if asymmetry:
        more, less = times("driven", 1 + asymmetry, most), times("driven", 1 - asymmetry, most)
        lines.append(f"    driven = driven > 0 ? {more} : {less};")
    if constant:
        lines.append(f"    driven += {whole(constant)};")
    return "\n".join([*lines, "    return driven;"])


def _estimator_drag(law: FeedForward, hardware: Hardware) -> str:
    drag = float(law.drag_V_s2_rad2)
    if not drag:
        return ""
    per = 65536 * drag / hardware.step_V / (16 * hardware.counts_per_tick) ** 2
    square = (16.0 * MOST_COUNTS / 4) ** 2
    return f"""\
    int32_t tenth = motor_clip(e->speed >> 12, {whole(16 * MOST_COUNTS / 4)});
    int32_t square = tenth < 0 ? -tenth * tenth : tenth * tenth;
    int32_t drag = {times("square", per, min(square, _room(per, 2.0**29)))};
    earlier -= drag;
    later -= drag;
"""
