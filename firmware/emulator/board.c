// The ATmega328P in simavr, with what its model needs to be right and fast.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_extint.h"
#include "sim_elf.h"

#include "bench.h"

#define RAM_START 0x100
#define PAINT 0xA5

static avr_run_t normal_run;

static void
no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    // simavr would wait on the wall clock; host.c does the pacing.
    (void)avr;
    (void)cycles;
}

static void
after_reset(struct bench *bench)
{
    avr_t *avr = bench->avr;
    avr->run_cycle_limit = 20000; // 1 after a reset, which halves the speed
    // Polling the pins' level from reset on would cost three quarters of the speed; edges do not need it.
    avr_extint_set_strict_lvl_trig(avr, 0, 0);
    avr_extint_set_strict_lvl_trig(avr, 1, 0);
    bench->boot = avr->cycle;
    timer1_reset(bench);
    pins_reset(bench);
    encoder_reset(bench);
    serial_reset(bench);
    watch_reset(bench);
}

void
board_setup(struct bench *bench)
{
    elf_firmware_t firmware = {0};
    if (elf_read_firmware(bench->options.elf, &firmware)) {
        fprintf(stderr, "bench: cannot read the firmware %s\n", bench->options.elf);
        exit(1);
    }
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    if (!avr) {
        fprintf(stderr, "bench: this simavr has no ATmega328P\n");
        exit(1);
    }
    bench->avr = avr;
    avr_init(avr);
    avr->frequency = firmware.frequency = CLOCK_Hz;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr_load_firmware(avr, &firmware);
    avr->log = LOG_NONE;
    avr->sleep = no_sleep;
    normal_run = avr->run;
    memset(avr->data + RAM_START, PAINT, avr->ramend + 1 - RAM_START);
}

// As by the reset pin. Never from inside a cycle timer: it empties the timers' pool.
void
board_reset(struct bench *bench)
{
    avr_reset(bench->avr);
    after_reset(bench);
}

int
board_run(struct bench *bench)
{
    avr_t *avr = bench->avr;
    // The watchdog resets by replacing this function for one call.
    int watchdog = avr->run != normal_run;
    int state = avr_run(avr);
    if (watchdog)
        after_reset(bench);
    return state != cpu_Done && state != cpu_Crashed;
}

// Put the processor into an endless loop with interrupts off, as a fault in the firmware might.
void
board_hang(struct bench *bench)
{
    avr_t *avr = bench->avr;
    avr->flash[avr->flashend - 1] = 0xFF; // rjmp .-2
    avr->flash[avr->flashend] = 0xCF;
    avr->pc = avr->flashend - 1;
    avr->sreg[S_I] = 0;
    avr->state = cpu_Running;
}

// Bytes of RAM that were never touched, between variables and stack.
int
board_stack_left(const struct bench *bench)
{
    int longest = 0, run = 0;
    for (int k = RAM_START; k <= bench->avr->ramend; ++k) {
        run = bench->avr->data[k] == PAINT ? run + 1 : 0;
        if (run > longest)
            longest = run;
    }
    return longest;
}
