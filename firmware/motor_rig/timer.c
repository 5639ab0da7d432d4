// Timer2: a tick every millisecond, and every n-th tick a sample.
//
// 5 ms are 80000 cycles, which no 8-bit timer counts in one go, hence the tick of 1 ms.

#include <avr/io.h>

#include "pwm.h" // DUTY_DELAY_us
#include "timer.h"

volatile uint8_t timer_alive;
volatile uint8_t timer_host_silent_ms;
uint8_t timer_period = 5;
volatile uint8_t timer_left = 1;

// Start Timer2 and Timer1 in step: prescalers held, both counters set, prescalers released.
// Timer1 counts up to TOP first, which it must reach DUTY_DELAY_us after each tick; ticks come every four
// PWM periods.
void
timer_setup(void)
{
    TIMSK0 = 0; // the Arduino core's clock interrupt would only add jitter
    TCCR2A = (1 << WGM21);
    TCCR2B = 0;
    ASSR = 0;
    OCR2A = F_CPU / 64 / 1000 - 1;
    TIMSK2 = (1 << OCIE2A);

    GTCCR = (1 << TSM) | (1 << PSRASY) | (1 << PSRSYNC);
    TCNT2 = 0;
    TCNT1 = FULL_SCALE - DUTY_DELAY_us * 2;
    TCCR2B = (1 << CS22);
    TCCR1B = (1 << WGM13) | (1 << CS11);
    GTCCR = 0;
}

// Make the tick after the next a sample: by then the pins have taken the mode that the bridge was just given, which
// they do at their next compare match, up to a PWM period later. Called with interrupts off.
void
timer_restart(void)
{
    timer_left = 2;
}
