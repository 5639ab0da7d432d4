// What can be read off a plant.

#include "plant_drive.h"
#include "plant_steps.h"

int
plant_edges(const struct plant *p, const struct plant_edge **edges)
{
    *edges = p->edges;
    return p->edges_count;
}

int64_t
plant_count(const struct plant *p)
{
    return p->count;
}

double
plant_time(const struct plant *p)
{
    return p->time;
}

double
plant_fastest(const struct plant *p)
{
    return p->fastest;
}

double
plant_angle(const struct plant *p)
{
    return p->now.angle;
}

double
plant_speed(const struct plant *p)
{
    return p->now.speed;
}

double
plant_current(const struct plant *p)
{
    return p->now.current;
}

double
plant_supply(const struct plant *p)
{
    double sag = p->hold == MEAN || p->hold == MEAN_COAST ? fabs(p->duty * p->now.current) : p->smoothed;
    return p->battery - p->source_resistance * sag;
}

double
plant_pulse_rate(const struct plant *p)
{
    return p->set.bench.pwm_edges > 0 ? p->set.bench.pwm_Hz : 0;
}

double
plant_resistance(const struct plant *p)
{
    return resistance_now(p);
}

double
plant_load_angle(const struct plant *p)
{
    return p->now.load_angle;
}

double
plant_load_speed(const struct plant *p)
{
    return p->now.load_speed;
}

void
plant_linear(const struct plant *p, double values[7])
{
    double sum = p->damping * p->resistance + p->constant * p->constant;
    values[0] = p->constant / sum;
    values[1] = sum / (p->resistance * p->inertia);
    values[2] = p->inductance / p->resistance;
    values[3] = p->resistance;
    values[4] = p->constant;
    values[5] = p->inertia;
    values[6] = p->damping;
}
