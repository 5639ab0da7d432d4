// Runs the plan: experiments one after the other, and everything that stops the motor.

#ifndef RUNNER_H
#define RUNNER_H

#include <stdint.h>

// What the host set for the next run.
struct limits {
    int32_t travel;   // counts from where the run began
    uint32_t time_ms; // since the run began
    uint16_t supply_mV;
};

extern struct limits runner_limits;
extern uint8_t runner_drive; // enum drive

uint8_t runner_running(void);
void runner_start(void);
void runner_stop(uint8_t reason);
void runner_skip(void);
void runner_poll(void);

void runner_sample(int32_t count);
void runner_millisecond(int32_t count);

#endif
