// Timer2: a tick every millisecond, and every n-th tick a sample. What a tick does: tick.c.

#ifndef TIMER_H
#define TIMER_H

#include <stdint.h>

#define TICK_us 1000
#define PERIOD_MAX_ms 20

extern volatile uint8_t timer_alive;          // set by every tick, cleared by who feeds the watchdog
extern volatile uint8_t timer_host_silent_ms; // since the last valid line from the host; stops at 255
extern uint8_t timer_period;                  // ticks from sample to sample
extern volatile uint8_t timer_left;           // ticks until the next sample

void timer_setup(void);
void timer_restart(void);

// Whether this tick is a sample. Called by the tick, once.
static inline uint8_t
timer_is_sample(void)
{
    if (--timer_left)
        return 0;
    timer_left = timer_period;
    return 1;
}

#endif
