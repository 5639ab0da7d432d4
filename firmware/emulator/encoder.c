// The plant's counts as edges on D2 (A) and D3 (B), each at its cycle.

#include "avr_ioport.h"

#include "bench.h"

#define QUEUE 1024

struct edge {
    avr_cycle_count_t when;
    uint8_t phase; // count modulo 4
};

static struct bench *bench;
static struct edge queue[QUEUE];
static unsigned head, tail;
static uint8_t phase;

// B and A for a count: 00 01 11 10.
static uint8_t
levels(uint8_t count)
{
    return (count ^ count >> 1) & 3;
}

static void
drive_pins(void)
{
    avr_t *avr = bench->avr;
    uint8_t pins = levels(phase);
    // What simavr falls back to whenever the firmware writes the port; else every write makes false edges.
    avr_ioport_external_t external = {.name = 'D', .mask = 0x0C, .value = pins << 2};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &external);
    for (int k = 0; k < 2; ++k)
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 2 + k), pins >> k & 1);
}

static avr_cycle_count_t
deliver(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)param;
    phase = queue[tail].phase;
    tail = (tail + 1) % QUEUE;
    drive_pins();
    if (head == tail)
        return 0;
    return queue[tail].when > when ? queue[tail].when : when + 1; // simavr forgets a timer that does not move on
}

static void
arm(void)
{
    avr_cycle_count_t now = bench->avr->cycle, when = queue[tail].when;
    avr_cycle_timer_register(bench->avr, when > now ? when - now : 1, deliver, NULL);
}

void
encoder_edge(avr_cycle_count_t when, int64_t count)
{
    int was_empty = head == tail;
    queue[head] = (struct edge){when, count & 3};
    head = (head + 1) % QUEUE;
    if (was_empty)
        arm();
}

void
encoder_setup(struct bench *b)
{
    bench = b;
}

// The shaft stays where it is: only the timer has to be set again.
void
encoder_reset(struct bench *b)
{
    (void)b;
    drive_pins();
    if (head != tail)
        arm();
}
