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

// Ticks that a slot's rest and its experiment ran.
struct ran {
    uint16_t rest, experiment;
};

extern struct limits runner_limits;
extern uint8_t runner_drive;  // enum drive
extern uint32_t runner_run;   // number of the last run that was started; 0 = none since the reset
extern uint32_t runner_ticks; // of it. Read with interrupts off
extern uint8_t runner_ended;  // enum reason, when it has

uint8_t runner_busy(void);
void runner_start(uint32_t run);
void runner_stop(uint8_t reason);
void runner_skip(uint8_t segment);
struct ran runner_ran(uint8_t slot);
void runner_poll(void);

void runner_sample(int32_t count);
void runner_millisecond(int32_t count);

#endif
