// Timer2: the 1 ms tick, and every n-th tick a sample.
//
// 5 ms are 80000 cycles, which no 8-bit timer counts in one go, hence the tick of 1 ms.

#include <avr/interrupt.h>
#include <avr/io.h>

#include "adc.h" // adc_tick
#include "encoder.h" // encoder_count
#include "pwm.h" // DUTY_DELAY_us
#include "runner.h" // runner_sample, runner_millisecond
#include "tick.h"

volatile uint8_t tick_alive;
volatile uint8_t tick_host_silent_ms;

static uint8_t period = 5;
static volatile uint8_t left = 1; // ticks until the next sample

// Start Timer2 and Timer1 in step: prescalers held, both counters set, prescalers released.
// Timer1 counts up to TOP first, which it must reach DUTY_DELAY_us after each tick; ticks come every four
// PWM periods.
void
tick_setup(void)
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

void
tick_period(uint8_t period_ms)
{
    period = period_ms;
}

uint8_t
tick_period_ms(void)
{
    return period;
}

// Make the tick after the next a sample: by then the pins have taken the mode that the bridge was just given, which
// they do at their next compare match, up to a PWM period later. Called with interrupts off.
void
tick_restart(void)
{
    left = 2;
}

// The tick. The count is latched first; a sample sets the duty next, at most 600 cycles after the timer's match
// (DUTY_DELAY_us are 640), and then lets other interrupts in (runner.c). Longest with a multisine of 8 tones: at
// most 2700 cycles, 450 of them with interrupts off.
ISR(TIMER2_COMPA_vect)
{
    int32_t count = encoder_count;
    if (--left == 0) {
        left = period;
        runner_sample(count);
    }
    sei();
    tick_alive = 1;
    if (tick_host_silent_ms != 255)
        ++tick_host_silent_ms;
    adc_tick();
    runner_millisecond(count);
}
