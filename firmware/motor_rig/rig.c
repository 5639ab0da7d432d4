// The rig's setup and loop, called by the sketch and by bare/main.c alike.
//
// Two things happen here. The tick interrupt (tick.c) samples, drives and watches; it puts what happened into
// a queue (events.c). The main loop takes lines from the host (commands.c), prepares the next experiment
// (runner_poll), turns the queue into lines (report.c), and sleeps.

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "adc.h"
#include "bridge.h"
#include "commands.h"
#include "config.h"
#include "encoder.h"
#include "pwm.h"
#include "report.h"
#include "rig.h"
#include "runner.h"
#include "timer.h"
#include "uart.h"

void
rig_setup(void)
{
    cli();
    bridge_setup(); // motor off before anything else
    pwm_setup();
    encoder_setup();
    adc_setup();
    uart_setup();
    timer_setup();
    set_sleep_mode(SLEEP_MODE_IDLE);
#if USE_WATCHDOG
    wdt_enable(WDTO_120MS);
#endif
    uart_put('\n'); // ends a line that a reset has torn
    uart_send();
    sei();
    report_hello(0);
}

// Sleep until there is something to do: not after every byte sent, but after every tick. Checked with
// interrupts off, else an interrupt between check and sleep would wait for the next one; the instruction
// after sei still runs before any interrupt.
static void
sleep_if_idle(void)
{
    sleep_enable();
    for (;;) {
        cli();
        if (timer_alive || uart_waiting() || report_waiting())
            break;
        sei();
        sleep_cpu();
        // The processor takes a pending interrupt before this, simavr after it: without it the next cli would
        // keep the interrupt out for ever there.
        __asm__ volatile("nop");
    }
    sei();
    sleep_disable();
}

void
rig_loop(void)
{
    if (timer_alive) {
        timer_alive = 0;
        wdt_reset();
    }
    commands_poll();
    runner_poll();
    report_poll();
    uart_baud_poll();
    sleep_if_idle();
}
