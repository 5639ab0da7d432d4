"""The estimator of `jaxmotor.control` in C: the same law in integers."""

import numpy as np

from jaxmotor.control import Estimator, FeedForward, Hardware
from jaxmotor.present.exports._fixed_point import times, whole

MOST_COUNTS = 4096
"""Count difference in a tick."""


def c_estimator(estimator: Estimator, hardware: Hardware) -> str:
    """C for `estimator`: states in 1/65536 of counts per tick, counts and duties."""
    a = np.asarray(estimator.transition)
    order = len(a) - 2
    speed, angle, volts = hardware.counts_per_tick, 1 / hardware.count_rad, 1 / hardware.step_V
    unit = np.array([speed] * order + [angle, volts])
    names = [*("speed", "torque")[:order], "ahead", "missing"]
    full = 2.0**30 - 2**17
    lines = []
    for row in range(order + 1):
        terms = [
            times(f"e->{names[k]}", scaled, _room(scaled, full))
            for k in range(order + 2)
            if (scaled := a[row, k] * unit[row] / unit[k]) and row != order
        ]
        if row == order:
            terms = ["e->ahead"]
            terms += [
                times(f"e->{names[k]}", scaled, _room(scaled, full))
                for k in (*range(order), order + 1)
                if (scaled := a[row, k] * unit[row] / unit[k])
            ]
        for drive, name in ((estimator.old_drive, "old"), (estimator.new_drive, "new")):
            scaled = float(np.asarray(drive)[row]) * unit[row] / volts
            if scaled:
                terms.append(times(name, scaled, _room(scaled, full)))
        lines.append(f"    int32_t {names[row]} = " + "\n        + ".join(terms) + ";")
    law = estimator.law
    budget = 65536 * float(estimator.per_volt) * float(law.friction_V) * speed
    if budget:
        share = float(estimator.turn_per_speed) * angle / speed
        lines.append(
            f"    // friction takes its full share, or stops the shaft\n"
            f"    int32_t lost = motor_clip(speed, {whole(abs(budget))});\n"
            "    speed -= lost;\n"
            f"    ahead -= {times('lost', share, full)};"
        )
    correction = np.asarray(estimator.correction) * unit / angle
    # A larger error than this is a count that was missed, and is corrected over several ticks.
    error = 65536 * min(256.0, 2**13 / float(np.abs(correction).max()))
    gains = [
        f"    e->{name} = {base} + {times('error', correction[k], error)};"
        for k, (name, base) in enumerate(zip(names, [*names[:-1], "e->missing"], strict=True))
    ]
    late = estimator.late
    shift = "\n".join(f"    e->driven[{k}] = e->driven[{k - 1}];" for k in range(late + 1, 0, -1))
    torque = "    int32_t torque;   // as the speed that it would hold, 1/65536 count per tick\n" if order == 2 else ""
    deviation = np.asarray(estimator.standard_deviation)
    body = "\n".join(lines)
    correct = "\n".join(gains)
    return f"""\
// Speed, angle and missing volts from counts: a steady Kalman filter, which knows encoder and friction.
// Standard deviation of the speed, as far as the model is right: {deviation[0]:.3g} rad/s; a count difference has
// {hardware.speed_noise_rad_s:.3g} rad/s, and is half a tick late. Start it with motor_estimate_begin at rest.
struct motor_estimate {{
    int32_t speed;    // at the tick, 1/65536 count per tick
{torque}    int32_t ahead;    // shaft's angle beyond the middle of the latched count, 1/65536 count
    int32_t missing;  // what the model lacks, 1/65536 duty
    int32_t count;    // latched
    int32_t driven[{late + 2}];  // duties as a linear motor sees them, the latest first, 1/65536 duty
}};

// A duty as a linear motor sees it [1/65536 duty].
static inline int32_t
motor_driven(int16_t duty)
{{
{_driven(law, hardware)}
}}

static inline void
motor_estimate_begin(struct motor_estimate *e, int32_t count)
{{
    *e = (struct motor_estimate){{.count = count}};
    for (uint8_t k = 0; k < {late + 2}; ++k)
        e->driven[k] = motor_driven(0);
}}

// Take a latched count. Call it once in each period, before the duty is set.
static inline void
motor_estimate_count(struct motor_estimate *e, int32_t count)
{{
    int32_t old = e->driven[{late + 1}], new = e->driven[{late}];
{_estimator_drag(law, hardware)}{body}
    ahead -= motor_clip(count - e->count, {MOST_COUNTS}) * 65536;
    int32_t error = motor_clip(-ahead, {whole(error)});
{correct}
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
{shift}
    e->driven[0] = motor_driven(duty);
}}
"""


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
    old -= drag;
    new -= drag;
"""
