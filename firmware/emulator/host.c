// When the host's bytes reach the board, and how the board's time follows the wall clock.
//
//   real      bytes as they come; simulated time follows the wall clock
//   fast      bytes as they come; as fast as it goes
//   lockstep  one whole line each time the board has been silent for a while, and time stands still while the
//             host has none: the moment a line arrives no longer depends on how fast anything runs, so a run
//             gives the same bytes every time. Stop (X) and skip (J) are handed over at once.
//
// Where time does not follow the wall clock the host's keepalives mean nothing. The bench then swallows them
// and sends its own, as long as a host is connected.

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "bench.h"
#include "transport.h"

#define SILENCE (30 * MS) // longer than the longest sampling period
#define KEEPALIVE_EVERY (100 * MS)
#define READ_EVERY (5 * MS)
#define BOOT (20 * MS) // bytes that come earlier would find the UART off

static char input[65536];
static int held;         // bytes of `input` that were not handed over
static int at_line_start; // the last byte handed over ended a line
static int present;      // a host
static int ended;        // it is gone, or standard input is at its end
static avr_cycle_count_t next_keepalive, next_read;
static struct timespec began;
static avr_cycle_count_t began_cycle;

static double
wall(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)(now.tv_sec - began.tv_sec) + (double)(now.tv_nsec - began.tv_nsec) * 1e-9;
}

static void
restart_clock(struct bench *bench)
{
    clock_gettime(CLOCK_MONOTONIC, &began);
    began_cycle = bench->avr->cycle;
}

static void
drop(int from, int length)
{
    memmove(input + from, input + from + length, (size_t)(held - from - length));
    held -= length;
}

static void
hand_over(int from, int length)
{
    if (!length)
        return;
    serial_feed(input + from, length);
    at_line_start = input[from + length - 1] == '\n';
    drop(from, length);
}

// Length of the line at `from` with its newline, 0 if it is not complete.
static int
line_length(int from)
{
    const char *end = memchr(input + from, '\n', (size_t)(held - from));
    return end ? (int)(end - input) - from + 1 : 0;
}

static void
read_host(struct bench *bench)
{
    if (held == (int)sizeof input)
        return;
    int got = transport_get(input + held, (int)sizeof input - held);
    if (got > 0) {
        double set = transport_baud(), board = serial_baud();
        if (bench->avr->cycle - bench->boot > 100 * MS && set > 0 && (set / board > 1.05 || set / board < 0.95))
            for (int k = 0; k < got; ++k)
                input[held + k] ^= 0x5A; // at the wrong rate nothing comes through
        held += got;
    } else if (got < 0) {
        ended = 1;
    }
}

// Lines that do not wait for silence (stop, skip), and the host's keepalives, which are the bench's business.
static void
sort_lines(struct bench *bench)
{
    int booted = bench->avr->cycle - bench->boot > BOOT;
    for (int at = 0, length; (length = line_length(at));) {
        if (input[at] == 'K')
            drop(at, length);
        else if (booted && (input[at] == 'X' || input[at] == 'J'))
            hand_over(at, length);
        else
            at += length;
    }
}

static void
keep_alive(struct bench *bench)
{
    avr_cycle_count_t now = bench->avr->cycle;
    if (now < next_keepalive)
        return;
    next_keepalive = now + KEEPALIVE_EVERY;
    if (serial_feeding() || (double)now / CLOCK_Hz >= bench->options.keepalive_until_s)
        return;
    if (!at_line_start)
        serial_feed("\n", 1); // the host tore a line
    at_line_start = 1;
    serial_feed("K*185F\n", 7);
}

// A host came: as a Nano does when its port is opened, start anew. The reset waits for the first byte, since
// pyserial throws away what arrives while it opens.
static void
arrive(struct bench *bench)
{
    held = 0;
    ended = 0;
    present = 1;
    while (!interrupted && !ended && held == 0) {
        transport_wait(-1);
        read_host(bench);
    }
    at_line_start = 1;
    bench->reset_wanted = !ended;
    present = !ended;
    restart_clock(bench);
}

static void
pace(struct bench *bench)
{
    double ahead = (double)(bench->avr->cycle - began_cycle) / CLOCK_Hz - wall();
    if (ahead > 1 || ahead < -1) {
        restart_clock(bench); // the machine slept or is too slow: do not rush to make up for it
    } else if (ahead > 0.001) {
        transport_flush();
        nanosleep(&(struct timespec){0, (long)(ahead * 1e9)}, NULL);
    }
}

// In lockstep, when the board has nothing more to say: the next line, and until there is one no time passes.
static void
next_line(struct bench *bench)
{
    while (!interrupted && !line_length(0) && !serial_feeding() && !ended) {
        transport_wait(-1);
        read_host(bench);
        sort_lines(bench);
    }
    hand_over(0, line_length(0));
}

static void
without_host(struct bench *bench, int silent)
{
    if (transport_connected())
        arrive(bench);
    else if (bench->options.mode != REAL && silent)
        transport_wait(-1);
}

static int
with_host(struct bench *bench, int silent)
{
    enum mode mode = bench->options.mode;
    avr_cycle_count_t now = bench->avr->cycle;
    if (!ended && (mode == REAL || now >= next_read)) {
        next_read = now + READ_EVERY;
        transport_flush();
        read_host(bench);
    }
    if (mode != REAL) {
        sort_lines(bench);
        // A script's end is not the end of its run; a host that hangs up is.
        if (!ended || bench->options.script)
            keep_alive(bench);
    }
    if (mode == LOCKSTEP && silent)
        next_line(bench);
    else if (mode != LOCKSTEP && now - bench->boot > BOOT)
        hand_over(0, held);
    if (!ended || !silent || serial_feeding() || line_length(0))
        return 1;
    if (bench->options.script && bench->options.until_s < 1e29)
        return 1; // asked to go on, though there will be no more commands
    present = 0;
    held = 0;
    return !bench->options.once;
}

int
host_serve(struct bench *bench)
{
    int silent = !serial_feeding() && bench->avr->cycle - serial_last() >= SILENCE;
    int go_on = 1;
    if (present)
        go_on = with_host(bench, silent);
    else
        without_host(bench, silent);
    if (bench->options.mode == REAL)
        pace(bench);
    return go_on;
}

void
host_setup(struct bench *bench)
{
    present = bench->options.script;
    at_line_start = 1;
    restart_clock(bench);
    if (!present)
        arrive(bench);
}
