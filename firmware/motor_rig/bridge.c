// The TB6612FNG: enable and standby pins, and what happens between pulses.
//
// Both decay modes come from AIN1 and AIN2 alone, with PWMA high (the bridge's truth table):
//
//                  AIN1        AIN2
//   forward brake  high        low in the pulse, high between     both high = winding shorted
//   forward coast  the pulse   low                                both low  = winding open
//
// PWMA itself can only brake between pulses, so it stays high while a run drives. Low, the bridge does not drive: it
// shorts the winding, or opens it where both inputs are low.

#include <avr/io.h>

#include "bridge.h"
#include "pwm.h" // pwm_mode

#define STBY (1 << PD6)
#define PWMA (1 << PD7)

// Standby first: the motor is off until a run begins. Called once.
void
bridge_setup(void)
{
    PORTD &= ~(STBY | PWMA);
    DDRD |= STBY | PWMA;
}

// Leave standby with the winding shorted (BRAKE) or open (COAST).
void
bridge_enable(uint8_t drive)
{
    pwm_mode(drive);
    PORTD |= STBY | PWMA;
}

// Short the winding, which stops the motor faster than an open one. PWMA first: until the timer comes to its top the
// old duty stands, which the pins' other polarity would make a pulse the other way. Interrupts may be on or off.
void
bridge_stop(void)
{
    PORTD &= ~PWMA;
    pwm_mode(BRAKE);
}
