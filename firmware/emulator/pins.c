// What the bridge's four pins do, to the cycle: how long each PWM period drives forward and backward.
//
// timer1.c integrates a period at once and takes the mode as it stands at its start. Here the output compare units
// are followed edge by edge, as the data sheet has them: a pin changes at its compare match, in the direction that
// the mode asks for at that moment, so that a mode changed within a period shows.

#include <stdio.h>
#include <stdlib.h>

#include "avr_ioport.h"

#include "bench.h"

#define PRESCALER 8
#define CHANNELS 2
#define EDGES 2 // of a channel in a period

enum { AIN1, AIN2 };
enum { CLEAR_UP = 2, SET_UP = 3 }; // COM1x1:0 in phase-correct mode: low, or high, outside the pulse

static struct bench *bench;
static FILE *file;
static avr_cycle_count_t seen;   // up to here it is accounted for
static avr_cycle_count_t top;    // start of the period
static int compare[CHANNELS], half; // timer counts
static int mode[CHANNELS], level[CHANNELS];
static int standby_off, pwma;
static unsigned long drove[2], told[2]; // cycles forward and backward in this period; as last written

static int
direction(void)
{
    if (!standby_off || !pwma || level[AIN1] == level[AIN2])
        return 0;
    return level[AIN1] ? 1 : -1;
}

// The k-th match of a channel in the period: on the way down, then on the way up. At 0 and at the top the second
// decides, so that the pin stays.
static avr_cycle_count_t
match(int channel, int k)
{
    int count = k ? half + compare[channel] : half - compare[channel];
    return top + (avr_cycle_count_t)count * PRESCALER;
}

static void
change(int channel, int k)
{
    if (mode[channel] < CLEAR_UP)
        return;
    int inside = mode[channel] == CLEAR_UP;
    if (compare[channel] == 0)
        level[channel] = !inside;
    else if (compare[channel] >= half)
        level[channel] = inside;
    else
        level[channel] = k ? !inside : inside;
}

static void
account(avr_cycle_count_t until)
{
    int way = direction();
    if (way)
        drove[way < 0] += until - seen;
    seen = until;
}

// Follow the pins up to `now`, which is not beyond the period's end.
static void
follow(avr_cycle_count_t now)
{
    while (half) {
        avr_cycle_count_t next = now + 1;
        for (int channel = 0; channel < CHANNELS; ++channel)
            for (int k = 0; k < EDGES; ++k)
                if (match(channel, k) > seen && match(channel, k) < next)
                    next = match(channel, k);
        if (next > now)
            break;
        account(next);
        for (int channel = 0; channel < CHANNELS; ++channel)
            for (int k = 0; k < EDGES; ++k)
                if (match(channel, k) == next)
                    change(channel, k);
    }
    account(now);
}

static void
tell(void)
{
    if (file && (drove[0] != told[0] || drove[1] != told[1]))
        fprintf(file, "%llu,%lu,%lu\n", (unsigned long long)top, drove[0], drove[1]);
    told[0] = drove[0];
    told[1] = drove[1];
    drove[0] = drove[1] = 0;
}

// A duty of the whole period has no match: its pin changes at the top, where it begins and where it ends.
static void
load(int channel, int count)
{
    int whole = compare[channel] >= half;
    compare[channel] = count;
    if (count >= half)
        change(channel, 0);
    else if (whole && mode[channel] >= CLEAR_UP)
        level[channel] = mode[channel] == SET_UP;
}

// The timer is at its top: the period that ends is written down where it differs from the one before.
void
pins_top(avr_cycle_count_t when, int icr, int ocr_a, int ocr_b)
{
    follow(when);
    tell();
    top = when;
    half = icr;
    load(AIN1, ocr_a);
    load(AIN2, ocr_b);
}

void
pins_mode(int com_a, int com_b)
{
    follow(bench->avr->cycle);
    mode[AIN1] = com_a;
    mode[AIN2] = com_b;
}

static void
enable(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    follow(bench->avr->cycle);
    *(int *)param = value != 0;
}

void
pins_setup(struct bench *b)
{
    bench = b;
    avr_irq_t *port = avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 0);
    avr_irq_register_notify(port + 6, enable, &standby_off);
    avr_irq_register_notify(port + 7, enable, &pwma);
    if (!b->options.pins)
        return;
    file = fopen(b->options.pins, "w");
    if (!file) {
        fprintf(stderr, "bench: cannot write %s\n", b->options.pins);
        exit(2);
    }
    fputs("cycle,forward,backward\n", file);
}

// The pins float: the bridge's own resistors pull them low.
void
pins_reset(struct bench *b)
{
    follow(b->avr->cycle);
    standby_off = pwma = 0;
    half = 0;
    for (int channel = 0; channel < CHANNELS; ++channel)
        mode[channel] = level[channel] = 0;
}

void
pins_close(void)
{
    follow(bench->avr->cycle);
    tell();
    if (file)
        fclose(file);
}
