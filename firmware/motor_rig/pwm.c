// Timer1: the pulses on AIN1 (D9, OC1A) and AIN2 (D10, OC1B).
//
//   TOP      BOTTOM      TOP         the counter runs down and up; a new duty loads at TOP,
//    |         |          |          the pulse is centred on BOTTOM
//    |     +-------+      |
//    +-----+ pulse +------+

#include "pwm.h"

uint8_t pwm_mirrored;

// Phase-correct with ICR1 as top (mode 10), prescaler 8. The counter is started by timer_setup.
void
pwm_setup(void)
{
    TIMSK1 = 0;
    TCCR1B = 0;
    ICR1 = FULL_SCALE;
    pwm_mode(BRAKE);
    DDRB |= (1 << PB1) | (1 << PB2);
}

// Zero duty, with both pins high (BRAKE, inverted outputs) or low (COAST) between pulses.
// Inverting the outputs swaps their roles, hence the mirror.
void
pwm_mode(uint8_t drive)
{
    OCR1A = 0;
    OCR1B = 0;
    if (drive == BRAKE)
        TCCR1A = (1 << COM1A1) | (1 << COM1A0) | (1 << COM1B1) | (1 << COM1B0) | (1 << WGM11);
    else
        TCCR1A = (1 << COM1A1) | (1 << COM1B1) | (1 << WGM11);
    pwm_mirrored = (drive == BRAKE) ^ MOTOR_REVERSED;
}
