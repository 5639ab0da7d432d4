// The rig's setup and loop, called by the sketch and by bare/main.c alike.
//
// Two things happen here. The tick interrupt (tick.c) samples, drives and watches; it puts what happened into
// a queue (events.c). The main loop takes lines from the host (commands.c), prepares the next experiment
// (runner_poll), turns the queue into lines (report.c), and sleeps.

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
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
#include "tick.h"
#include "uart.h"

static uint8_t reset_flags __attribute__((section(".noinit")));

// After a watchdog reset the watchdog is still on, with its shortest time: switch it off first thing.
void
rig_early(void) __attribute__((naked, used, section(".init3")));
void
rig_early(void)
{
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

// Why the board started: "watchdog", or "power" for everything else (a bootloader clears the rest).
const char *
rig_reset_cause(void)
{
    static const char power[] PROGMEM = "power", watchdog[] PROGMEM = "watchdog";
    return reset_flags & (1 << WDRF) ? watchdog : power;
}

void
rig_setup(void)
{
    cli();
    bridge_setup(); // motor off before anything else
    pwm_setup();
    encoder_setup();
    adc_setup();
    uart_setup();
    tick_setup();
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
        if (tick_alive || uart_waiting() || report_waiting())
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
    if (tick_alive) {
        tick_alive = 0;
        wdt_reset();
    }
    commands_poll();
    runner_poll();
    report_poll();
    uart_baud_poll();
    sleep_if_idle();
}
