// Timer1: the pulses on AIN1 (D9, OC1A) and AIN2 (D10, OC1B).

#ifndef PWM_H
#define PWM_H

#include <avr/io.h>
#include <stdint.h>

#include "config.h" // MOTOR_REVERSED

// 16 MHz / 8 / (2 x 250) = 4000 Hz: four periods per 1 ms tick, so every duty is held for a whole number
// of pulses and takes effect at the same time after its tick. 255 steps would be 3921.6 Hz, and the duty
// would act 0 to 255 us late, differently at every tick.
#define FULL_SCALE 250
#define PWM_Hz 4000

// A duty takes effect this long after its tick: time for the tick interrupt to set it (tick.c).
#define DUTY_DELAY_us 40

enum drive { BRAKE, COAST }; // both pins high between pulses, or low

extern uint8_t pwm_mirrored;

void pwm_setup(void);
void pwm_mode(uint8_t drive);

// Drive with `duty` of FULL_SCALE from the next pulse on. Called by the tick interrupt; both registers are
// double-buffered and load together, so a change of sign makes no glitch.
static inline void
pwm_set(int16_t duty)
{
    if (pwm_mirrored)
        duty = -duty;
    if (duty >= 0) {
        OCR1A = duty;
        OCR1B = 0;
    } else {
        OCR1A = 0;
        OCR1B = -duty;
    }
}

#endif
