// Quadrature encoder on D2 (INT0, phase A) and D3 (INT1, phase B), all four edges.

#ifndef ENCODER_H
#define ENCODER_H

#include <stdint.h>

// Written by the edge interrupt. Read with interrupts off.
extern volatile int32_t encoder_count;
extern volatile uint16_t encoder_illegal;

void encoder_setup(void);

#endif
