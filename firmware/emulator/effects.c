// What a plant file says, as numbers. One row per key: where it goes, its default, its range.

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "effects.h"
#include "toml.h"

#define NEVER 1e30
#define WHEN -1e30, 1e30
#define VOLTS 0, 1000
#define SIGNED_VOLTS -1000, 1000
#define SPEED 1e-6, 1e6
#define FREQUENCY 1e-3, 1e4
#define INERTIA_RATIO 1e-4, 1e4
#define CYCLES 1e-3, 1e5
#define ANGLE -1e6, 1e6
#define SLOWNESS 1e-6, 1e9
#define SHARE 0, 0.999
#define REQUIRED -2e30 // no default: a table without this key is an error

static const struct key {
    const char *table, *key;
    size_t on, offset;
    double value, low, high;
} keys[] = {
#define KEY(table, key, value, ...) \
    {#table, #key, offsetof(struct parameters, table.on), offsetof(struct parameters, table.key), value, __VA_ARGS__}
    KEY(motor, resistance_ohm, 4.5, 1e-3, 1e5),
    KEY(motor, inductance_H, 524e-6, 0, 10),
    KEY(motor, gain_rad_s_V, 10.6, 1e-3, 1e5),
    KEY(motor, pole_rad_s, 40, 1e-3, 1e4),
    KEY(motor, viscous_share, 0.045, SHARE),
    KEY(motor, torque_constant_Nm_A, 0, 0, 1e3),
    KEY(motor, inertia_kgm2, 0, 0, 1e6),
    KEY(motor, damping_Nms, 0, 0, 1e6),
    KEY(battery, volts_V, 7.4, VOLTS),
    KEY(battery, resistance_ohm, 0, 0, 1e6),
    KEY(battery, droop_V_per_As, 0, 0, 1e6),
    KEY(battery, smoothing_s, 1e-3, SLOWNESS),
    KEY(battery, cutoff_at_s, NEVER, WHEN),
    KEY(battery, cutoff_V, 0, VOLTS),
    KEY(bridge, diode_V, 0.7, VOLTS),
    KEY(encoder, counts_per_rev, 617.4, 1e-3, 1e8),
    KEY(encoder, start_fraction, -1, -1, 1),
    KEY(encoder, start_angle_rad, NEVER, ANGLE),
    KEY(wiring, motor_swapped, 0, 0, 1),
    KEY(wiring, encoder_swapped, 0, 0, 1),
    KEY(wiring, unplugged_at_s, NEVER, WHEN),
    KEY(wiring, jammed_at_s, NEVER, WHEN),
    KEY(bench, seed, 1, 0, 0x1p53),
    KEY(bench, step_s, 1e-5, 1e-7, 2e-5),
    KEY(bench, pwm_edges, 1, 0, 1),
    KEY(bench, pwm_Hz, 4000, 1, 10000),

    KEY(transport_delay, delay_s, REQUIRED, 0, 0.1),
    KEY(dead_zone, volts_V, REQUIRED, VOLTS),
    KEY(input_threshold, volts_V, REQUIRED, VOLTS),
    KEY(voltage_offset, volts_V, REQUIRED, SIGNED_VOLTS),
    KEY(voltage_saturation, volts_V, REQUIRED, VOLTS),
    KEY(current_limit, volts_V, REQUIRED, VOLTS),
    KEY(direction_asymmetry, ratio, REQUIRED, -1, 1),
    KEY(supply_sag, ratio, REQUIRED, 0, 1e3),
    KEY(supply_drift, rate_per_s, REQUIRED, -0.1, 1e3),
    KEY(electrical_pole, time_constant_s, REQUIRED, 0, 10),

    KEY(coulomb_friction, volts_V, REQUIRED, VOLTS),
    KEY(load_torque, volts_V, REQUIRED, SIGNED_VOLTS),
    KEY(stiction, volts_V, REQUIRED, VOLTS),
    KEY(stiction, static_volts_V, REQUIRED, VOLTS),
    KEY(stiction, stribeck_speed_rad_s, REQUIRED, SPEED),
    KEY(stiction, exponent, 2, 1, 2),
    KEY(quadratic_drag, volts_V_s2_rad2, REQUIRED, 0, 1e6),
    KEY(cogging, volts_V, REQUIRED, SIGNED_VOLTS),
    KEY(cogging, cycles_per_rev, REQUIRED, CYCLES),
    KEY(cogging, phase_rad, 0, ANGLE),
    KEY(winding_heating, rise_ratio, REQUIRED, 0, 100),
    KEY(winding_heating, time_constant_s, REQUIRED, 1e-3, 1e9),
    KEY(shaft_compliance, frequency_Hz, REQUIRED, FREQUENCY),
    KEY(shaft_compliance, damping_ratio, REQUIRED, 0, 100),
    KEY(shaft_compliance, inertia_ratio, REQUIRED, INERTIA_RATIO),
    KEY(backlash, gap_rad, REQUIRED, 0, 1e6),
    KEY(backlash, inertia_ratio, REQUIRED, INERTIA_RATIO),
    KEY(backlash, contact_frequency_Hz, 90, FREQUENCY),
    KEY(backlash, contact_damping_ratio, 0.3, 0, 100),

    KEY(encoder_eccentricity, amplitude_rad, REQUIRED, -10, 10),
    KEY(encoder_eccentricity, cycles_per_rev, REQUIRED, CYCLES),
    KEY(encoder_eccentricity, phase_rad, 0, ANGLE),
    KEY(missed_counts, ratio, REQUIRED, 0, 1),
    KEY(missed_counts, speed_rad_s, REQUIRED, 0, 1e9),
    KEY(sensor_lag, time_constant_s, REQUIRED, SLOWNESS),

    KEY(late_load, start_s, REQUIRED, WHEN),
    KEY(late_load, volts_V, REQUIRED, SIGNED_VOLTS),
    KEY(outside_torque, frequency_Hz, REQUIRED, 0, 1e4),
    KEY(outside_torque, volts_V, REQUIRED, SIGNED_VOLTS),
    KEY(outside_torque, phase_rad, 0, ANGLE),
    KEY(wandering_torque, volts_V, REQUIRED, VOLTS),
    KEY(wandering_torque, time_constant_s, REQUIRED, SLOWNESS),
#undef KEY
};
#define KEYS ((int)(sizeof keys / sizeof *keys))

struct parse {
    struct parameters *parameters;
    char message[200];
};

static double *
place(struct parameters *parameters, const struct key *key)
{
    return (double *)((char *)parameters + key->offset);
}

static int *
switch_of(struct parameters *parameters, const struct key *key)
{
    return (int *)((char *)parameters + key->on);
}

static const char *
begin_table(struct parse *parse, const char *table)
{
    if (!strcmp(table, "coast_drive")) {
        parse->parameters->coast_drive.on = 1;
        return NULL;
    }
    for (int k = 0; k < KEYS; ++k)
        if (!strcmp(table, keys[k].table)) {
            *switch_of(parse->parameters, &keys[k]) = 1;
            return NULL;
        }
    snprintf(parse->message, sizeof parse->message, "no effect or part is called [%.60s]", table);
    return parse->message;
}

static const char *
visit(void *context, const char *table, const char *key, const char *value, int is_text)
{
    struct parse *parse = context;
    if (!key)
        return begin_table(parse, table);
    for (int k = 0; k < KEYS; ++k) {
        if (strcmp(table, keys[k].table) || strcmp(key, keys[k].key))
            continue;
        char *end;
        double number = !strcmp(value, "true") ? 1 : !strcmp(value, "false") ? 0 : strtod(value, &end);
        if (is_text || (strcmp(value, "true") && strcmp(value, "false") && *end) || number != number) {
            snprintf(parse->message, sizeof parse->message, "%.60s must be a number", key);
            return parse->message;
        }
        if (number < keys[k].low || number > keys[k].high) {
            snprintf(parse->message, sizeof parse->message, "%.60s = %g is out of range: %g to %g", key, number,
                     keys[k].low, keys[k].high);
            return parse->message;
        }
        *place(parse->parameters, &keys[k]) = number;
        return NULL;
    }
    if (is_text && !*table)
        return NULL; // a title or a note at the top
    snprintf(parse->message, sizeof parse->message, *table ? "[%.60s] has no key %.60s" : "%.0s%.60s stands in no [table]",
             table, key);
    return parse->message;
}

int
effects_parse(struct parameters *parameters, const char *toml, char *error, int error_size)
{
    memset(parameters, 0, sizeof *parameters);
    for (int k = 0; k < KEYS; ++k)
        *place(parameters, &keys[k]) = keys[k].value;
    struct parse parse = {.parameters = parameters};
    if (toml_parse(toml, visit, &parse, error, error_size))
        return -1;
    for (int k = 0; k < KEYS; ++k) {
        double *number = place(parameters, &keys[k]);
        if (*number != REQUIRED)
            continue;
        if (*switch_of(parameters, &keys[k])) {
            snprintf(error, error_size, "[%s] needs %s", keys[k].table, keys[k].key);
            return -1;
        }
        *number = 0;
    }
    if (parameters->motor.torque_constant_Nm_A > 0 && parameters->motor.inertia_kgm2 <= 0) {
        snprintf(error, error_size, "[motor] torque_constant_Nm_A needs inertia_kgm2 beside it");
        return -1;
    }
    return 0;
}
