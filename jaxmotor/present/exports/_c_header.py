"""The motor as a C header: feed-forward, speed loop, position loop and estimator in integers, for a microcontroller.

No float, no division, no memory but the structures that the caller gives. The laws of the estimator and of the loops
are those of `jaxmotor.control`, whose simulation predicts what this code does.
"""

from jaxmotor._arguments import taken
from jaxmotor._errors import JaxmotorError
from jaxmotor.control import FeedForward, Hardware, feed_forward, reachable_rad_s
from jaxmotor.estimate import AnyModel, Model, model_of
from jaxmotor.present.exports._c_estimator import MOST_COUNTS, c_estimator
from jaxmotor.present.exports._c_loops import c_duties, c_feed_forward, c_position_loop, c_speed_loop
from jaxmotor.present.exports._design import Design
from jaxmotor.present.exports._fixed_point import TIMES16, ascii_line, comment, times, whole
from jaxmotor.present.exports._left_out import left_out

MOST_FULL_SCALE = 4095


def to_c(model: AnyModel, design: Design) -> str:
    """The header's text.

    **Raises:** `JaxmotorError` where a number does not fit into the integers.
    """
    model = model_of(model)
    hardware = taken(design, Design, "a Design (of jaxmotor.present.exports.design)").hardware
    if hardware.full_scale > MOST_FULL_SCALE:
        raise JaxmotorError(f"full_scale = {hardware.full_scale} is more than the C header's {MOST_FULL_SCALE}")
    try:
        parts = _parts(model, design)
    except OverflowError as error:
        raise JaxmotorError(
            f"{model.source}: the C header's 32 bits do not hold this loop ({error}); ask for a lower bandwidth"
        ) from error
    return "\n".join(parts)


def _parts(model: Model, design: Design) -> list[str]:
    hardware, law = design.hardware, feed_forward(model.whole)
    fastest = min(MOST_COUNTS, 2 * reachable_rad_s(model.whole, hardware.supply_V) * hardware.counts_per_tick + 4)
    return [
        _head(model, design),
        _constants(hardware, fastest),
        TIMES16,
        _conversion(hardware, fastest),
        _drive(law, hardware),
        c_feed_forward(law, hardware, fastest, design.linear_step),
        c_speed_loop(design.speed, law, hardware, fastest),
        c_position_loop(design.position, hardware),
        c_estimator(design.estimator, hardware),
        "#endif\n",
    ]


def _head(model: Model, design: Design) -> str:
    motor, hardware, speed, position = model.motor, design.hardware, design.speed, design.position
    lines = [
        "A motor and its controllers, written by jaxmotor export. Change the model and export again, not this file.",
        "",
        f"model      gain {float(motor.gain):.6g} rad/s/V, pole {float(motor.pole):.6g} rad/s, "
        f"from {comment(model.recording) or 'an unnamed recording'}",
        *(f"effect     {name}" for name in design.effects),
        f"rig        {hardware.counts_per_rev:g} counts per turn, {1e3 * hardware.period_s:g} ms, "
        f"{hardware.supply_V:g} V, full scale {hardware.full_scale}",
        f"speed      {speed.kind}, {speed.gain_V_s_rad:.5g} V s/rad, {speed.integral_gain_V_rad:.5g} V/rad; "
        f"{speed.bandwidth_Hz:.3g} Hz, overshoot {speed.overshoot_percent:.2g} %",
        f"position   {position.gain_V_rad:.5g} V/rad, {position.speed_gain_V_s_rad:.5g} V s/rad; "
        f"{position.bandwidth_Hz:.3g} Hz, overshoot {position.overshoot_percent:.2g} %",
        "",
        "Units: a speed is in 1/256 count per tick, a voltage in 1/256 duty, both int32_t; a count is what the encoder",
        "counts. Call once per period, first latch the count, then set the duty.",
        "",
        *(f"Not carried: {comment_line}" for comment_line in left_out(model, "c")),
        *(f"Note: {note}" for note in dict.fromkeys((*speed.notes, *position.notes))),
    ]
    guard = ["", "#ifndef JAXMOTOR_MOTOR_H", "#define JAXMOTOR_MOTOR_H", "", "#include <stdint.h>", ""]
    return "\n".join([*(f"// {ascii_line(line)}".rstrip() for line in lines), *guard])


def _constants(hardware: Hardware, fastest: float) -> str:
    return "\n".join(
        [
            f"#define MOTOR_FULL_SCALE {hardware.full_scale}",
            f"#define MOTOR_FULL_VOLTAGE INT32_C({256 * hardware.full_scale})  // the same in 1/256 duty",
            f"#define MOTOR_PERIOD_us {whole(1e6 * hardware.period_s)}",
            "// Largest speed that the code is exact for [1/256 count per tick]",
            f"#define MOTOR_SPEED_MAX {whole(256 * fastest)}",
            "",
        ]
    )


def _conversion(hardware: Hardware, fastest: float) -> str:
    per_mrad = 256 * hardware.counts_per_tick / 1000
    return f"""\
static inline int32_t
motor_clip(int32_t x, int32_t limit)
{{
    return x > limit ? limit : x < -limit ? -limit : x;
}}

// A speed [1/1000 rad/s] in 1/256 count per tick.
static inline int32_t
motor_speed_from_mrad_s(int32_t speed)
{{
    return {times("speed", per_mrad, 256 * fastest / per_mrad)};
}}

// A voltage in whole duties, rounded and limited.
static inline int16_t
motor_duty(int32_t voltage)
{{
    return (int16_t)((motor_clip(voltage, MOTOR_FULL_VOLTAGE) + 128) >> 8);
}}
"""


def _drive(law: FeedForward, hardware: Hardware) -> str:
    friction, dead_zone = c_duties(float(law.friction_V), hardware), c_duties(float(law.dead_zone_V), hardware)
    constant = round(c_duties(float(law.load_V) - float(law.offset_V), hardware))
    asymmetry = float(law.asymmetry)
    most = 8 * 256 * hardware.full_scale
    lines = []
    if asymmetry:
        lines += [
            "    // one direction gets more voltage than the other",
            f"    voltage = voltage > 0 ? {times('voltage', 1 / (1 + asymmetry), most)}",
            f"                          : {times('voltage', 1 / (1 - asymmetry), most)};",
        ]
    if dead_zone:
        lines += [
            "    if (voltage)",
            f"        voltage += voltage > 0 ? {whole(dead_zone)} : {whole(-dead_zone)};  // dead zone",
        ]
    body = "\n".join([*lines, "    return voltage;"])
    return f"""\
// The voltage that friction, load and offset take from a motion in the direction `way`: 1, -1, or 0 for rest.
static inline int32_t
motor_load(int8_t way)
{{
    return way > 0 ? {round(friction) + constant} : way < 0 ? {constant - round(friction)} : {constant};
}}

// What the bridge must be told so that `voltage` arrives: asymmetry and dead zone taken into account.
static inline int32_t
motor_bridge(int32_t voltage)
{{
{body}
}}
"""
