// The emulated bench: board, plant, and the line to the host. Shared by its parts.

#ifndef BENCH_H
#define BENCH_H

#include <signal.h>
#include <stddef.h>
#include <stdint.h>

#include "sim_avr.h"

#include "plant.h"

#define CLOCK_Hz 16000000u
#define MS (CLOCK_Hz / 1000) // cycles

enum mode { LOCKSTEP, FAST, REAL };

struct options {
    const char *elf, *link, *stats, *pins;
    enum mode mode;
    double until_s, keepalive_until_s, hang_at_s;
    int once;   // leave when the host does
    int script; // the host is standard input
};

struct bench {
    struct options options;
    avr_t *avr;
    struct plant *plant;
    int reset_wanted;
    avr_cycle_count_t boot; // cycle of the last reset
};

// board.c: the ATmega328P
void board_setup(struct bench *bench);
void board_reset(struct bench *bench);
int board_run(struct bench *bench); // until something happens; 0 = the processor stopped for good
void board_hang(struct bench *bench);
int board_stack_left(const struct bench *bench);

// timer1.c: the pulses, and with them the plant
void timer1_setup(struct bench *bench);
void timer1_reset(struct bench *bench);

// pins.c: what the bridge's pins do, to the cycle
void pins_setup(struct bench *bench);
void pins_reset(struct bench *bench);
void pins_top(avr_cycle_count_t when, int icr, int ocr_a, int ocr_b);
void pins_mode(int com_a, int com_b);
void pins_close(void);

// encoder.c: the plant's counts as edges on D2 and D3
void encoder_setup(struct bench *bench);
void encoder_reset(struct bench *bench);
void encoder_edge(avr_cycle_count_t when, int64_t count);

// serial.c: the UART
void serial_setup(struct bench *bench);
void serial_reset(struct bench *bench);
void serial_feed(const char *bytes, int length);
int serial_feeding(void);
avr_cycle_count_t serial_last(void); // cycle of the last byte either way, keepalives left out
double serial_baud(void);

// watch.c: what the interrupts take
void watch_setup(struct bench *bench);
void watch_reset(struct bench *bench);
void watch_clocks_started(avr_cycle_count_t when);
void watch_duty_written(void);
void watch_write(const struct bench *bench, const char *path, double cpu_s);

// host.c: when the host's bytes reach the board
void host_setup(struct bench *bench);
int host_serve(struct bench *bench); // every ms of the board's time; 0 = nothing more will happen

#endif
