// The plant: battery, bridge, motor, shaft and encoder, integrated at 10 us, with any effects in it.
//
// Used by the emulated board and, as libplant.so, by tests. README.md lists what a plant file may contain.
// SI units; everything about the motor is at the output shaft.

#ifndef PLANT_H
#define PLANT_H

#include <stdint.h>

#define EDGES_MAX 256

enum plant_drive { DRIVE_BRAKE, DRIVE_COAST, DRIVE_OFF };

struct plant;

// One encoder count, `after_s` from the start of the last plant_hold.
struct plant_edge {
    double after_s;
    int64_t count;
};

struct plant *plant_create(const char *toml, char *error, int error_size);
void plant_destroy(struct plant *plant);

// Hold a signed duty (-1..1) for `seconds`. Where the plant draws pulses ([bench] pwm = "edges") this is one
// pulse, centred, so `seconds` is one PWM period.
void plant_hold(struct plant *plant, double duty, int drive, double seconds);

// The encoder counts during the last plant_hold, oldest first. Returns how many.
int plant_edges(const struct plant *plant, const struct plant_edge **edges);

int64_t plant_count(const struct plant *plant);
double plant_fastest(const struct plant *plant); // counts/s at full duty, or driven by its load with the bridge open
double plant_time(const struct plant *plant);    // s
double plant_angle(const struct plant *plant);   // rad, true
double plant_speed(const struct plant *plant);   // rad/s, true
double plant_current(const struct plant *plant); // A
double plant_supply(const struct plant *plant);  // V at the bridge
double plant_resistance(const struct plant *plant); // ohm, as warm as it is
double plant_load_angle(const struct plant *plant); // rad, of the load behind a spring or a gap
double plant_load_speed(const struct plant *plant); // rad/s

// The motor's own linear values, without any effect: gain [rad/s/V], pole [rad/s], L/R [s], R [ohm],
// torque constant [Nm/A], inertia [kg m2], damping [Nms].
void plant_linear(const struct plant *plant, double values[7]);

// A rig without the board, for tests of many motors: at each of `ticks` ticks the count is latched, then the
// duty is set, which acts `delay_s` later. The arrays have `ticks` elements; outputs may be NULL.
void plant_sequence(struct plant *plant, int ticks, double period_s, double delay_s, int full_scale, int drive,
                    const int32_t *duty, int64_t *count, double *angle, double *speed, double *supply);

// The same with the firmware's speed loop (speed_loop.h) choosing the duties. `state` = {previous count,
// integral} carries a loop over several calls; start it with {plant_count, 0}.
void plant_loop(struct plant *plant, int ticks, double period_s, double delay_s, int full_scale, int drive,
                const int32_t *reference, uint16_t kp, uint16_t ki, int64_t state[2], int32_t *duty, int64_t *count,
                double *angle, double *speed);

#endif
