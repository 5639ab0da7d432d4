// A rig without the board: whole duty sequences in one call, for tests of many motors.
//
// The order of things is the board's: at a tick the count is latched, then the duty is chosen; it acts from
// `delay_s` after the tick until `delay_s` after the next.

#include <math.h>

#include "plant.h"
#include "plant_steps.h"

static void
latch(const struct plant *p, int k, int64_t *count, double *angle, double *speed, double *supply)
{
    if (count)
        count[k] = plant_count(p);
    if (angle)
        angle[k] = plant_angle(p);
    if (speed)
        speed[k] = plant_speed(p);
    if (supply)
        supply[k] = plant_supply(p);
}

// From one tick to the next.
static void
hold(struct plant *p, double tick, double period, double delay, double duty, int drive)
{
    double rate = plant_pulse_rate(p);
    int pulses = rate > 0 ? (int)floor(period * rate + 0.5) : 1;
    plant_advance(p, tick + delay);
    for (int k = 0; k < pulses; ++k) {
        plant_queue(p, tick + delay + k * period / pulses, duty, drive, period / pulses);
        plant_advance(p, tick + (k == pulses - 1 ? period : delay + (k + 1) * period / pulses));
    }
}

void
plant_sequence(struct plant *p, int ticks, double period_s, double delay_s, int full_scale, int drive,
               const int32_t *duty, int64_t *count, double *angle, double *speed, double *supply)
{
    double began = plant_time(p);
    for (int k = 0; k < ticks; ++k) {
        latch(p, k, count, angle, speed, supply);
        hold(p, began + k * period_s, period_s, delay_s, (double)duty[k] / full_scale, drive);
    }
}

static int64_t
clip(int64_t x, int64_t limit)
{
    return x > limit ? limit : x < -limit ? -limit : x;
}

// The law of motor_rig/speed_loop.h, word for word.
static int32_t
speed_loop(int64_t difference, int32_t reference, uint16_t kp, uint16_t ki, int full_scale, int64_t *integral)
{
    int64_t error = clip(reference - 16 * difference, 8191);
    int64_t u = (kp * error + (*integral >> 8) + 2048) >> 12;
    int32_t duty = (int32_t)clip(u, full_scale);
    int winds_up = (u > full_scale && error > 0) || (u < -full_scale && error < 0);
    if (!winds_up)
        *integral = clip(*integral + ki * error, (int64_t)full_scale << 20);
    return duty;
}

void
plant_loop(struct plant *p, int ticks, double period_s, double delay_s, int full_scale, int drive,
           const int32_t *reference, uint16_t kp, uint16_t ki, int64_t state[2], int32_t *duty, int64_t *count,
           double *angle, double *speed)
{
    double began = plant_time(p);
    for (int k = 0; k < ticks; ++k) {
        latch(p, k, count, angle, speed, 0);
        int64_t now = plant_count(p);
        int32_t chosen = speed_loop(now - state[0], reference[k], kp, ki, full_scale, &state[1]);
        state[0] = now;
        if (duty)
            duty[k] = chosen;
        hold(p, began + k * period_s, period_s, delay_s, (double)chosen / full_scale, drive);
    }
}
