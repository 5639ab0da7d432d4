// What a plant file says, as numbers: one structure per table. A table that is absent leaves `on` 0.

#ifndef EFFECTS_H
#define EFFECTS_H

struct parameters {
    struct { int on; double resistance_ohm, inductance_H, gain_rad_s_V, pole_rad_s, viscous_share,
                            torque_constant_Nm_A, inertia_kgm2, damping_Nms; } motor;
    struct { int on; double volts_V, resistance_ohm, droop_V_per_As, smoothing_s, cutoff_at_s, cutoff_V; } battery;
    struct { int on; double diode_V; } bridge;
    struct { int on; double counts_per_rev, start_fraction, start_angle_rad; } encoder;
    struct { int on; double motor_swapped, encoder_swapped, unplugged_at_s, jammed_at_s; } wiring;
    struct { int on; double seed, step_s, pwm_edges, pwm_Hz; } bench;

    // drive
    struct { int on; double delay_s; } transport_delay;
    struct { int on; double volts_V; } dead_zone, input_threshold, voltage_offset, voltage_saturation, current_limit;
    struct { int on; double ratio; } direction_asymmetry, supply_sag;
    struct { int on; double rate_per_s; } supply_drift;
    struct { int on; } coast_drive;
    struct { int on; double time_constant_s; } electrical_pole;

    // motion
    struct { int on; double volts_V; } coulomb_friction, load_torque;
    struct { int on; double volts_V, static_volts_V, stribeck_speed_rad_s, exponent; } stiction;
    struct { int on; double volts_V_s2_rad2; } quadratic_drag;
    struct { int on; double volts_V, cycles_per_rev, phase_rad; } cogging;
    struct { int on; double rise_ratio, time_constant_s; } winding_heating;
    struct { int on; double frequency_Hz, damping_ratio, inertia_ratio; } shaft_compliance;
    struct { int on; double gap_rad, inertia_ratio, contact_frequency_Hz, contact_damping_ratio; } backlash;

    // sensor
    struct { int on; double amplitude_rad, cycles_per_rev, phase_rad; } encoder_eccentricity;
    struct { int on; double ratio, speed_rad_s; } missed_counts;
    struct { int on; double time_constant_s; } sensor_lag;

    // outside the vocabulary
    struct { int on; double start_s, volts_V; } late_load;
    struct { int on; double frequency_Hz, volts_V, phase_rad; } outside_torque;
    struct { int on; double volts_V, time_constant_s; } wandering_torque;
};

// Defaults, then what `toml` says. Returns 0, or -1 with a sentence in `error`.
int effects_parse(struct parameters *parameters, const char *toml, char *error, int error_size);

#endif
