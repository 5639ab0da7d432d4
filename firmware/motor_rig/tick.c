// The tick: what happens every millisecond, on time.

#include <avr/interrupt.h>

#include "adc.h" // adc_tick
#include "encoder.h" // encoder_count
#include "runner.h" // runner_sample, runner_millisecond
#include "timer.h"

// The count is latched first; a sample sets the duty next, at most 600 cycles after the timer's match
// (DUTY_DELAY_us are 640), and then lets other interrupts in (runner.c). Longest with a multisine of 8 tones: at
// most 2700 cycles, 450 of them with interrupts off.
ISR(TIMER2_COMPA_vect)
{
    int32_t count = encoder_count;
    if (timer_is_sample())
        runner_sample(count);
    sei();
    timer_alive = 1;
    if (timer_host_silent_ms != 255)
        ++timer_host_silent_ms;
    adc_tick();
    runner_millisecond(count);
}
