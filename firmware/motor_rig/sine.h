// Sine of a phase in 1/65536 turn, times 32767.

#ifndef SINE_H
#define SINE_H

#include <stdint.h>

int16_t sine(uint16_t phase);

#endif
