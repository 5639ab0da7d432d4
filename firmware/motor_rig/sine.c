// Sine of a phase in 1/65536 turn, times 32767.

#include <avr/pgmspace.h>

#include "sine.h"

// The first quarter in 64 steps; straight lines between are off by 2.5 at most (0.02 of 250 duties).
static const int16_t quarter[65] PROGMEM = {
    0, 804, 1608, 2410, 3212, 4011, 4808, 5602, 6393, 7179,
    7962, 8739, 9512, 10278, 11039, 11793, 12539, 13279, 14010, 14732,
    15446, 16151, 16846, 17530, 18204, 18868, 19519, 20159, 20787, 21403,
    22005, 22594, 23170, 23731, 24279, 24811, 25329, 25832, 26319, 26790,
    27245, 27683, 28105, 28510, 28898, 29268, 29621, 29956, 30273, 30571,
    30852, 31113, 31356, 31580, 31785, 31971, 32137, 32285, 32412, 32521,
    32609, 32678, 32728, 32757, 32767,
};

int16_t
sine(uint16_t phase)
{
    // The second quarter is the first mirrored; the lower half of the turn is the upper one negated.
    uint16_t within = phase & 0x3FFF;
    if (phase & 0x4000)
        within = 0x4000 - within;
    uint8_t step = within >> 8;
    int16_t value = pgm_read_word(&quarter[step]);
    if (step < 64)
        value += (uint32_t)(uint16_t)(pgm_read_word(&quarter[step + 1]) - value) * (uint8_t)within >> 8;
    return phase & 0x8000 ? -value : value;
}
