// From the shaft's angle to the encoder's edges. Part of plant.c.

#ifndef PLANT_SENSOR_H
#define PLANT_SENSOR_H

#include "plant_state.h"

#define COUNTS_PER_STEP_MAX 1e4 // a plant that gets there has come apart
#define COUNTS_MAX 1e15         // of which a double still knows the fraction

// What the encoder's disc shows, in rad.
static inline double
shown(const struct plant *p)
{
    const struct parameters *set = &p->set;
    double angle = p->now.angle - p->missed;
    if (set->encoder_eccentricity.on) {
        double phase = set->encoder_eccentricity.cycles_per_rev * p->now.angle + set->encoder_eccentricity.phase_rad;
        angle += set->encoder_eccentricity.amplitude_rad * maths_sin(phase);
    }
    return angle;
}

static inline double
position(const struct plant *p)
{
    return p->direction * (p->set.sensor_lag.on ? p->lagged : shown(p)) * p->counts_per_rad + p->fraction;
}

static inline void
add_edges(struct plant *p, double from, double to, double began, double h)
{
    if (!(fabs(to - from) < COUNTS_PER_STEP_MAX && fabs(to) < COUNTS_MAX)) {
        p->diverged = 1;
        return;
    }
    int64_t count = (int64_t)maths_floor(to);
    if (p->time >= p->set.wiring.unplugged_at_s)
        return;
    while (p->count != count) {
        int up = count > p->count;
        double line = (double)(up ? p->count + 1 : p->count);
        double share = to != from ? (line - from) / (to - from) : 1;
        p->count += up ? 1 : -1;
        if (p->edges_count < EDGES_MAX)
            p->edges[p->edges_count++] = (struct plant_edge){
                began - p->hold_began + (share < 0 ? 0 : share > 1 ? 1 : share) * h, p->count};
    }
}

#endif
