// Current, torques and friction. Part of plant.c.

#ifndef PLANT_MOTION_H
#define PLANT_MOTION_H

#include "plant_drive.h"

// Volts against the motion in either direction, at `speed`.
static inline double
friction(const struct plant *p, double speed)
{
    const struct parameters *set = &p->set;
    double volts = set->coulomb_friction.volts_V;
    if (set->stiction.on) {
        double x = fabs(speed) / set->stiction.stribeck_speed_rad_s;
        double fall = set->stiction.exponent < 1.5 ? x : x * x;
        volts += set->stiction.volts_V;
        if (fall < 40)
            volts += (set->stiction.static_volts_V - set->stiction.volts_V) * maths_exp(-fall);
    }
    return volts;
}

// Volts against positive motion from everything else.
static inline double
resisting(const struct plant *p, const struct state *s)
{
    const struct parameters *set = &p->set;
    double volts = p->steady;
    if (set->quadratic_drag.on)
        volts += set->quadratic_drag.volts_V_s2_rad2 * s->speed * fabs(s->speed);
    if (set->cogging.on)
        volts += set->cogging.volts_V * maths_sin(set->cogging.cycles_per_rev * s->angle + set->cogging.phase_rad);
    return volts;
}

// Torque that the load takes from the motor's side of the spring or gap.
static inline double
spring_torque(const struct plant *p, const struct state *s)
{
    double twist = s->angle - s->load_angle;
    double beyond = twist > p->gap ? twist - p->gap : twist < -p->gap ? twist + p->gap : 0;
    if (p->gap > 0 && beyond == 0)
        return 0;
    double torque = p->spring * beyond + p->spring_damping * (s->speed - s->load_speed);
    // Surfaces in contact push; they do not pull.
    return p->gap > 0 && torque * beyond < 0 ? 0 : torque;
}

static inline double
current_cap(const struct plant *p, double current)
{
    return p->set.current_limit.on ? clip(current, p->set.current_limit.volts_V / p->resistance) : current;
}

// The current where it has no dynamics of its own: no inductance, or the mean law of the coast drive.
static inline double
static_current(const struct plant *p, double speed)
{
    double resistance = resistance_now(p);
    if (p->hold == OPEN)
        return 0;
    if (p->hold == MEAN_COAST) {
        // The winding is connected for the share |duty| of the time and the current flows one way only.
        double share = fabs(p->duty), towards = sign(p->duty);
        double volts = asymmetric(p, towards * p->battery) + p->set.voltage_offset.volts_V - p->constant * speed;
        double current = share * volts / (resistance + p->source_resistance * share * share);
        return current_cap(p, current * towards > 0 ? current : 0);
    }
    double back = p->constant * speed;
    double current = (winding_volts(p, 0) - back) / resistance;
    if (p->hold == MEAN && p->source_resistance > 0) {
        // volts = duty (battery - Rs |duty i|) is linear in i once its sign is known
        double source = p->source_resistance * fabs(p->duty) * p->duty * sign(current);
        current = (winding_volts(p, 0) - back) / (resistance + source);
    }
    return current_cap(p, current);
}

static inline int
current_is_static(const struct plant *p)
{
    return p->inductance <= 0 || p->hold == MEAN_COAST;
}

static inline double
current_rate(const struct plant *p, const struct state *s)
{
    double volts;
    if (p->hold == OPEN) {
        if (p->flows == 0)
            return 0;
        volts = -p->flows * (p->battery + 2 * p->set.bridge.diode_V); // through the diodes, back to the battery
    } else {
        volts = p->hold == PULSE ? p->pulse_volts : winding_volts(p, s->current);
    }
    return (volts - p->hot * s->current - p->constant * s->speed) * p->per_inductance;
}

// Torque on the rotor without friction.
static inline double
torque(const struct plant *p, const struct state *s)
{
    double current = current_is_static(p) ? static_current(p, s->speed) : current_cap(p, s->current);
    double sum = p->constant * current - p->damping * s->speed - p->per_volt * resisting(p, s);
    return p->two_masses ? sum - spring_torque(p, s) : sum;
}

#endif
