// Quadrature encoder on D2 (INT0, phase A) and D3 (INT1, phase B), all four edges.
//
//          +---+   +---+            forward: A leads B
//   A  ----+   +---+   +---
//            +---+   +---+
//   B  ------+   +---+   +-
//      00 10 11 01 00 ...           AB; each step is one count

#include <avr/interrupt.h>
#include <avr/io.h>

#include "config.h" // ENCODER_REVERSED
#include "encoder.h"

#define FORWARD (ENCODER_REVERSED ? -1 : 1)
#define BACKWARD (-FORWARD)
#define ILLEGAL 2

volatile int32_t encoder_count;
volatile uint16_t encoder_illegal;

static uint8_t state; // the last BA, shifted left by two: the upper half of the table's index

// Index: last B, last A, B, A (port bits 3 and 2). Two bits changed at once: an edge was missed, and its
// direction is not known. No bit changed: both interrupts were pending and the first saw both edges.
static const int8_t steps[16] = {
    0,        FORWARD,  BACKWARD, ILLEGAL,  // last BA = 00
    BACKWARD, 0,        ILLEGAL,  FORWARD,  // 01
    FORWARD,  ILLEGAL,  0,        BACKWARD, // 10
    ILLEGAL,  BACKWARD, FORWARD,  0,        // 11
};

void
encoder_setup(void)
{
    DDRD &= ~((1 << PD2) | (1 << PD3));
    PORTD |= (1 << PD2) | (1 << PD3); // pull-ups: an unplugged encoder is silent, not noisy
    EICRA = (1 << ISC00) | (1 << ISC10);
    state = PIND & 0x0C;
    EIFR = (1 << INTF0) | (1 << INTF1);
    EIMSK = (1 << INT0) | (1 << INT1);
}

// One edge. At most 110 cycles, so 10 kHz of edges take 7 % of the time.
ISR(INT0_vect)
{
    uint8_t pins = PIND & 0x0C;
    int8_t step = steps[state | (pins >> 2)];
    state = pins;
    if (step == ILLEGAL)
        ++encoder_illegal;
    else
        encoder_count += step;
}

ISR(INT1_vect, ISR_ALIASOF(INT0_vect));
