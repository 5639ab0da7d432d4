// Battery and bridge: from a duty to the voltage at the winding. Part of plant.c, which the compiler sees whole:
// these run 400 000 times per simulated second.

#ifndef PLANT_DRIVE_H
#define PLANT_DRIVE_H

#include <math.h>

#include "plant_state.h"

static inline double
open_circuit(const struct plant *p)
{
    const struct parameters *set = &p->set;
    if (p->time >= set->battery.cutoff_at_s)
        return set->battery.cutoff_V;
    double volts = set->battery.volts_V;
    if (set->supply_drift.on)
        volts *= 1 - set->supply_drift.rate_per_s * p->time;
    volts -= set->battery.droop_V_per_As * p->drawn;
    return volts > 0 ? volts : 0;
}

// The duty that the effects on the mean voltage leave of `duty`. With pulses they shorten the pulse.
static inline double
shaped(const struct plant *p, double duty)
{
    const struct parameters *set = &p->set;
    double supply = open_circuit(p);
    if (supply <= 0)
        return 0;
    double volts = duty * supply, size = fabs(volts);
    if (set->dead_zone.on)
        size = size > set->dead_zone.volts_V ? size - set->dead_zone.volts_V : 0;
    if (set->input_threshold.on && size < set->input_threshold.volts_V)
        size = 0;
    if (set->voltage_saturation.on && size > set->voltage_saturation.volts_V)
        size = set->voltage_saturation.volts_V;
    return clip(sign(volts) * size / supply, 1);
}

static inline double
asymmetric(const struct plant *p, double volts)
{
    return p->set.direction_asymmetry.on ? volts * (1 + p->set.direction_asymmetry.ratio * sign(volts)) : volts;
}

static inline double
resistance_now(const struct plant *p)
{
    return p->resistance * (1 + p->rise);
}

// The voltage at the winding for `current`; the bridge is not open.
static inline double
winding_volts(const struct plant *p, double current)
{
    double sag = p->hold == PULSE ? p->smoothed : fabs(p->duty * current);
    return asymmetric(p, p->duty * (p->battery - p->source_resistance * sag)) + p->set.voltage_offset.volts_V;
}

#endif
