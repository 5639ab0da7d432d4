// A plant from its file: the motor's constants from what the file gives, and where everything starts.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "plant_drive.h"
#include "plant_sensor.h"

#define TRIAL_ms 800

static void
derive(struct plant *p)
{
    const struct parameters *set = &p->set;
    p->resistance = set->motor.resistance_ohm;
    p->inductance = set->motor.inductance_H;
    if (set->electrical_pole.on)
        p->inductance = set->electrical_pole.time_constant_s * p->resistance;
    if (set->motor.torque_constant_Nm_A > 0) {
        p->constant = set->motor.torque_constant_Nm_A;
        p->damping = set->motor.damping_Nms;
        p->inertia = set->motor.inertia_kgm2;
    } else {
        // gain = Kt / (b R + Kt^2), pole = (b R + Kt^2) / (R J), viscous_share = b R / (b R + Kt^2)
        double share = set->motor.viscous_share, gain = set->motor.gain_rad_s_V;
        double sum = (1 - share) / (gain * gain);
        p->constant = gain * sum;
        p->damping = share * sum / p->resistance;
        p->inertia = sum / (p->resistance * set->motor.pole_rad_s);
    }
    p->per_volt = p->constant / p->resistance;
    p->source_resistance = set->battery.resistance_ohm + set->supply_sag.ratio * p->resistance;
    p->rubs = set->coulomb_friction.on || set->stiction.on;
    p->two_masses = set->shaft_compliance.on || set->backlash.on;
    if (p->two_masses) {
        // The load swings at `frequency` on its spring (or contact) while the rotor is held.
        int spring = set->shaft_compliance.on;
        double ratio = spring ? set->shaft_compliance.inertia_ratio : set->backlash.inertia_ratio;
        double swing = 2 * PI * (spring ? set->shaft_compliance.frequency_Hz : set->backlash.contact_frequency_Hz);
        double damping = spring ? set->shaft_compliance.damping_ratio : set->backlash.contact_damping_ratio;
        p->load_inertia = ratio * p->inertia;
        p->spring = p->load_inertia * swing * swing;
        p->spring_damping = 2 * damping * swing * p->load_inertia;
        p->gap = set->backlash.on ? set->backlash.gap_rad / 2 : 0;
    }
    p->per_inductance = p->inductance > 0 ? 1 / p->inductance : 0;
    p->per_inertia = 1 / p->inertia;
    p->counts_per_rad = set->encoder.counts_per_rev / (2 * PI);
    p->direction = set->wiring.encoder_swapped > 0 ? -1 : 1;
}

// Derived values are rounded.
static int
within(double value, double low, double high)
{
    return value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9);
}

static int
motor_refused(const struct plant *p, char *error, int error_size)
{
    double v[7];
    plant_linear(p, v);
    const char *wrong = NULL;
    double found = 0;
    if (!within(v[0], 1e-3, 1e5))
        wrong = "[motor] has a gain of %g rad/s/V: 0.001 to 1e5", found = v[0];
    else if (!within(v[1], 1e-3, 1e4))
        wrong = "[motor] has a pole of %g rad/s: 0.001 to 1e4", found = v[1];
    else if (v[2] != 0 && !within(v[2], 1e-6, 10))
        wrong = "[motor] has an electrical time constant L/R of %g s: 0, or 1e-6 to 10", found = v[2];
    if (wrong)
        snprintf(error, error_size, wrong, found);
    return wrong != NULL;
}

// An open bridge, full duty and a short circuit for a moment. A motor whose parts do not fit together shows it at once:
// a step of the integration is too long for a stiff spring or brake, and the numbers grow beyond all bounds.
static int
motion_refused(struct plant *p, char *error, int error_size)
{
    struct plant *trial = malloc(sizeof *trial);
    if (!trial)
        abort();
    *trial = *p;
    trial->set.transport_delay.on = 0;
    trial->set.late_load.start_s = 0;
    trial->set.wiring.jammed_at_s = trial->set.wiring.unplugged_at_s = 1e30;
    for (int k = 0; k < TRIAL_ms && !trial->diverged; ++k) {
        int part = 4 * k / TRIAL_ms;
        plant_hold(trial, part == 2, part < 2 ? DRIVE_OFF : DRIVE_BRAKE, 1e-3);
        double rate = fabs(trial->now.speed) * trial->counts_per_rad;
        p->fastest = rate > p->fastest ? rate : p->fastest;
    }
    const struct state *s = &trial->now;
    int lost = trial->diverged || !isfinite(s->current) || !isfinite(s->load_speed) || !isfinite(trial->smoothed);
    free(trial);
    if (lost)
        snprintf(error, error_size, "the motor cannot be integrated: a spring, brake or source is too stiff for it");
    return lost;
}

struct plant *
plant_create(const char *toml, char *error, int error_size)
{
    struct plant *p = calloc(1, sizeof *p);
    if (!p || effects_parse(&p->set, toml, error, error_size)) {
        free(p);
        return NULL;
    }
    derive(p);
    p->random.state = (uint64_t)p->set.bench.seed;
    double fraction = random_uniform(&p->random), turn = random_uniform(&p->random);
    p->now.angle = p->set.encoder.start_angle_rad < 1e29 ? p->set.encoder.start_angle_rad : 2 * PI * turn;
    p->now.load_angle = p->now.angle;
    p->lagged = shown(p);
    // The counter starts at 0, somewhere within a count.
    p->fraction = 0;
    double start = position(p);
    p->fraction = (p->set.encoder.start_fraction >= 0 ? p->set.encoder.start_fraction : fraction) - start;
    p->wander_to = p->set.wandering_torque.on ? p->set.wandering_torque.volts_V * random_normal(&p->random) : 0;
    p->battery = open_circuit(p);
    if (motor_refused(p, error, error_size) || motion_refused(p, error, error_size)) {
        free(p);
        return NULL;
    }
    return p;
}

void
plant_destroy(struct plant *plant)
{
    free(plant);
}
