// The plan: what the host uploaded, one slot per experiment.

#ifndef PLAN_H
#define PLAN_H

#include <stdint.h>

#define PLAN_SLOTS 60

enum kind { REST, STEP, RAMP, SINE, MULTISINE, CHIRP, PRBS, LOOP, KINDS };

// The numbers as the host sent them; experiment.c says what they mean for each kind. When a rest or an experiment has
// ended, `rest` or `ticks` is what it ran: a plan is run once.
struct slot {
    uint8_t kind;
    uint16_t rest;  // ticks of zero duty before the experiment
    uint16_t ticks; // length of the experiment
    uint32_t a;
    int32_t b;
    int16_t c;
};

extern struct slot plan[PLAN_SLOTS];
extern uint8_t plan_count;

#endif
