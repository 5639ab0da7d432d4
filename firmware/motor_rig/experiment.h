// The experiments: one duty per sample.

#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include <stdint.h>

#include "plan.h" // struct slot
#include "speed_loop.h" // struct speed_loop

#define TONES_MAX 8

// An experiment under way. `duty` is the next one to set.
struct experiment {
    uint8_t kind, slot;
    uint8_t before; // the rest before a slot's experiment
    uint16_t ticks;
    int16_t duty;
    int32_t amplitude;
    int32_t offset;    // or the value that a ramp has reached
    uint32_t phase, increment;
    int32_t slope;
    union {
        struct {
            uint8_t tones, stride;
            uint16_t phases[TONES_MAX];
        };
        struct {
            uint16_t shift_register;
            uint8_t order, tap, hold, left;
        };
        struct speed_loop loop;
    };
};

uint8_t experiment_valid(const struct slot *slot);
void experiment_prepare(struct experiment *e, const struct slot *slot);
void experiment_rest(struct experiment *e, uint16_t ticks);
void experiment_next(struct experiment *e);

#endif
