// The TB6612FNG: enable and standby pins, and what happens between pulses.

#ifndef BRIDGE_H
#define BRIDGE_H

#include <stdint.h>

#include "pwm.h" // enum drive

void bridge_setup(void);
void bridge_enable(uint8_t drive);
void bridge_stop(void);

#endif
