// Why the board started, read before anything else runs.

#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>

#include "reset.h"

static uint8_t flags __attribute__((section(".noinit")));

// After a watchdog reset the watchdog is still on, with its shortest time: switch it off first thing.
void
reset_early(void) __attribute__((naked, used, section(".init3")));
void
reset_early(void)
{
    flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

// In flash: "watchdog", or "power" for everything else (a bootloader clears the rest).
const char *
reset_cause(void)
{
    static const char power[] PROGMEM = "power", watchdog[] PROGMEM = "watchdog";
    return flags & (1 << WDRF) ? watchdog : power;
}
