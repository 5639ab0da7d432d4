"""Feed-forward, speed loop and position loop in C: the laws of `jaxmotor.control` in integers."""

from jaxmotor.control import FeedForward, Hardware, PositionDesign, SpeedDesign
from jaxmotor.present.exports._c_estimator import MOST_COUNTS
from jaxmotor.present.exports._fixed_point import times, whole


def c_duties(volts: float, hardware: Hardware) -> float:
    """In 1/256 duty."""
    return 256 * volts / hardware.step_V


def _drag(law: FeedForward, hardware: Hardware, fastest: float) -> str:
    """C for the voltage of the drag at the speed `reference`."""
    drag = float(law.drag_V_s2_rad2)
    if not drag:
        return ""
    # The square of a speed in whole 1/16 counts per tick, times 1/256 duty per that.
    per = c_duties(drag, hardware) / (16 * hardware.counts_per_tick) ** 2
    square = (16 * fastest) ** 2
    return f"""\
    int32_t tenth = reference >> 4;
    int32_t square = tenth < 0 ? -tenth * tenth : tenth * tenth;
    voltage += {times("square", per, square)};  // drag
"""


def c_feed_forward(law: FeedForward, hardware: Hardware, fastest: float, step: float) -> str:
    """`step` is K (1 - p), what a volt adds to the speed in a tick [rad/s/V]."""
    limit = 256 * fastest
    hold = c_duties(1 / float(law.gain), hardware) / (256 * hardware.counts_per_tick)
    change = c_duties(1 / step, hardware) / (256 * hardware.counts_per_tick)
    # A larger change than this asks for more than four times the supply.
    most = min(2 * limit, 4 * 256 * hardware.full_scale / abs(change))
    return f"""\
// The duty that takes the motor from speed `now` to speed `next` in this tick.
static inline int16_t
motor_feed_forward(int32_t now, int32_t next)
{{
    int32_t reference = motor_clip(now, MOTOR_SPEED_MAX);
    int32_t change = motor_clip(next - now, {whole(most)});
    int32_t voltage = {times("reference", hold, limit)};
    voltage += {times("change", change, most)};
{_drag(law, hardware, fastest)}    int32_t going = next ? next : now;
    return motor_duty(motor_bridge(voltage + motor_load(going > 0 ? 1 : going < 0 ? -1 : 0)));
}}
"""


def c_speed_loop(design: SpeedDesign, law: FeedForward, hardware: Hardware, fastest: float) -> str:
    per_speed = 1 / (256 * hardware.counts_per_tick)
    gain = c_duties(design.gain_V_s_rad, hardware) * per_speed
    integral = 256 * c_duties(design.integral_gain_V_rad * hardware.period_s, hardware) * per_speed
    most = min(2 * 256 * fastest, 4 * 256 * hardware.full_scale / abs(gain))
    limit = 256 * fastest
    ahead = ""
    if design.feeds_forward:
        hold = c_duties(1 / float(law.gain), hardware) * per_speed
        ahead = f"    voltage += {times('reference', hold, limit)};  // r/K\n"
    return f"""\
// {design.kind} speed loop: {design.gain_V_s_rad:.5g} V s/rad, {design.integral_gain_V_rad:.5g} V/rad.
// Start it with {{0}} and motor_speed_reference.
struct motor_speed_loop {{
    int32_t reference;  // 1/256 count per tick
    int32_t ahead;      // fed forward, 1/256 duty
    int32_t integral;   // 1/65536 duty
    int32_t error;      // 1/256 count per tick
    int8_t clipped;     // sign of the voltage where it is beyond full scale, else 0
}};

// Set the `reference` [1/256 count per tick] where it begins or changes.
static inline void
motor_speed_reference(struct motor_speed_loop *loop, int32_t reference)
{{
    reference = motor_clip(reference, MOTOR_SPEED_MAX);
    int32_t voltage = motor_load(reference > 0 ? 1 : reference < 0 ? -1 : 0);
{ahead}{_drag(law, hardware, fastest)}    loop->reference = reference;
    loop->ahead = voltage;
}}

// The duty for the measured `speed`: 256 times the count difference, or the estimator's.
static inline int16_t
motor_speed_duty(struct motor_speed_loop *loop, int32_t speed)
{{
    int32_t error = motor_clip(loop->reference - speed, {whole(most)});
    int32_t voltage = motor_bridge({times("error", gain, most)} + (loop->integral >> 8) + loop->ahead);
    loop->error = error;
    loop->clipped = voltage > MOTOR_FULL_VOLTAGE ? 1 : voltage < -MOTOR_FULL_VOLTAGE ? -1 : 0;
    return motor_duty(voltage);
}}

// Take the error into the integral; it waits while that would wind it up. May be done after the duty is set.
static inline void
motor_speed_integrate(struct motor_speed_loop *loop)
{{
    if ((loop->clipped > 0 && loop->error > 0) || (loop->clipped < 0 && loop->error < 0))
        return;
    loop->integral = motor_clip(loop->integral + {times("loop->error", integral, most)}, MOTOR_FULL_VOLTAGE * 256);
}}
"""


def c_position_loop(design: PositionDesign, hardware: Hardware) -> str:
    gain = c_duties(design.gain_V_rad * hardware.count_rad, hardware)
    speed = c_duties(design.speed_gain_V_s_rad, hardware) / hardware.counts_per_tick
    far = max(2.0, 4 * 256 * hardware.full_scale / abs(gain))
    return f"""\
// Position loop: {design.gain_V_rad:.5g} V/rad, {design.speed_gain_V_s_rad:.5g} V s/rad.
// `difference` is that of the count to the count one tick before.
static inline int16_t
motor_position_duty(int32_t reference, int32_t count, int32_t difference)
{{
    int32_t error = motor_clip(reference - count, {whole(far)});
    int32_t turn = motor_clip(difference, {MOST_COUNTS});
    int8_t way = error > 1 ? 1 : error < -1 ? -1 : 0;
    if (!way && !turn)
        return 0;
    int32_t voltage = {times("error", gain, far)} - {times("turn", speed, MOST_COUNTS)};
    return motor_duty(motor_bridge(voltage + motor_load(way)));
}}
"""
