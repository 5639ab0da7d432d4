// Timer2: the 1 ms tick, and every n-th tick a sample.

#ifndef TICK_H
#define TICK_H

#include <stdint.h>

#define TICK_us 1000
#define PERIOD_MAX_ms 20

extern volatile uint8_t tick_alive; // set by every tick, cleared by who feeds the watchdog
extern volatile uint8_t tick_host_silent_ms; // since the last valid line from the host; stops at 255

void tick_setup(void);
void tick_period(uint8_t period_ms);
uint8_t tick_period_ms(void);
void tick_restart(void);

#endif
