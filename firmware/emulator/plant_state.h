// What the plant is made of, for the parts of plant.c.

#ifndef PLANT_STATE_H
#define PLANT_STATE_H

#include <math.h>
#include <stdint.h>

#include "effects.h"
#include "maths.h"
#include "plant.h"

#define EVENTS_MAX 4096 // 3 per PWM period, and up to 0.1 s of delay: 1200
#define WANDER_STEP 1e-3

struct state {
    double current, speed, angle, load_speed, load_angle;
};

// How the bridge holds the winding.
enum hold { OPEN, PULSE, MEAN, MEAN_COAST };

struct event {
    double at;
    int hold;
    double duty; // PULSE: -1, 0 (shorted), 1; MEAN, MEAN_COAST: -1..1
};

struct plant {
    struct parameters set;
    // derived once
    double resistance, inductance, constant, inertia, damping;
    double per_volt; // torque of one volt of friction [Nm]
    double load_inertia, spring, spring_damping, gap;
    double source_resistance, per_inductance, per_inertia;
    int two_masses, rubs;
    double counts_per_rad, fraction, direction;
    double fastest; // of the encoder, when the plant was tried [counts/s]
    // state
    double time;
    struct state now;
    double rise;     // of the resistance, relative
    double drawn;    // charge [As]
    double smoothed; // battery current [A]
    double lagged, missed; // sensor [rad]
    int diverged;          // a number left all bounds: the shaft stands still from then on
    double wander_from, wander_to, wander_at;
    struct random random;
    int stuck;
    int64_t count;
    // bridge
    int hold;
    double duty;
    struct event events[EVENTS_MAX];
    int events_head, events_tail;
    // per step
    double battery, steady, hot, pulse_volts; // V, V, ohm, V
    double flows; // direction of the current through the diodes: fixed within a step, else its end is smeared
    // output
    double hold_began;
    struct plant_edge edges[EDGES_MAX];
    int edges_count;
};

static inline double
sign(double x)
{
    return (x > 0) - (x < 0);
}

// What has died away is zero: the processor is a hundred times slower with numbers below 1e-308.
static inline double
settled(double x)
{
    return fabs(x) < 1e-100 ? 0 : x;
}

static inline double
clip(double x, double limit)
{
    return x > limit ? limit : x < -limit ? -limit : x;
}

#endif
