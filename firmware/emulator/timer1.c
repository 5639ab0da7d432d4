// Timer1 in phase-correct PWM, which simavr lacks, and the bridge behind its two pins.
//
// Each period begins at TOP, where the duties load; the plant is then integrated over that period at once, and
// its encoder edges wait until their cycle comes. A change of the enable pins counts from the next period on.

#include "avr_adc.h"

#include "bench.h"

enum { // ATmega328P, data addresses
    DDRB = 0x24, PORTB = 0x25, DDRD = 0x2A, PORTD = 0x2B, GTCCR = 0x43,
    TCCR1A = 0x80, TCCR1B = 0x81, TCNT1L = 0x84, TCNT1H = 0x85,
    ICR1L = 0x86, OCR1AL = 0x88, OCR1BL = 0x8A, TCCR2B = 0xB1, TCNT2 = 0xB2,
};

#define PRESCALER 8
#define IDLE_PERIOD (CLOCK_Hz / 4000)
#define STBY (1 << 6)
#define PWMA (1 << 7)
#define DIVIDER (33.0 / 133.0)

static struct bench *bench;
static int started;

static int
word(int low)
{
    return bench->avr->data[low] | bench->avr->data[low + 1] << 8;
}

// A pin of port B within a period: high or low outside the pulse and inside it, and the pulse's share.
struct pin {
    int outside, inside;
    double share;
};

static struct pin
pin(int bit, int mode, int compare)
{
    const uint8_t *data = bench->avr->data;
    double share = (double)word(compare) / word(ICR1L);
    if (!(data[DDRB] & 1 << bit))
        return (struct pin){0, 0, 0};
    if (mode < 2)
        return (struct pin){data[PORTB] >> bit & 1, data[PORTB] >> bit & 1, 0};
    return (struct pin){mode == 3, mode == 2, share > 1 ? 1 : share};
}

// What the TB6612FNG makes of a period: signed duty and what happens between pulses.
static int
bridge(double *duty)
{
    const uint8_t *data = bench->avr->data;
    int enabled = data[PORTD] & data[DDRD];
    *duty = 0;
    if (!started || !(enabled & STBY))
        return DRIVE_OFF;
    int mode = data[TCCR1A];
    struct pin a = pin(1, mode >> 6 & 3, OCR1AL), b = pin(2, mode >> 4 & 3, OCR1BL);
    if (!(enabled & PWMA))
        return a.outside || b.outside ? DRIVE_BRAKE : DRIVE_OFF;
    double share = a.share > b.share ? a.share : b.share;
    // The firmware moves one pin at a time, so the other one's level inside the pulse is the one outside.
    int in_a = a.share > 0 ? a.inside : a.outside, in_b = b.share > 0 ? b.inside : b.outside;
    *duty = share * (in_a - in_b);
    return a.outside ? DRIVE_BRAKE : DRIVE_COAST;
}

static avr_cycle_count_t
period(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)param;
    avr_cycle_count_t length = started ? 2u * word(ICR1L) * PRESCALER : IDLE_PERIOD;
    double duty;
    int drive = bridge(&duty);
    if (started)
        pins_top(when, word(ICR1L), word(OCR1AL), word(OCR1BL));
    plant_hold(bench->plant, duty, drive, (double)length / CLOCK_Hz);
    const struct plant_edge *edges;
    int count = plant_edges(bench->plant, &edges);
    for (int k = 0; k < count; ++k)
        encoder_edge(when + (avr_cycle_count_t)(edges[k].after_s * CLOCK_Hz), edges[k].count);
    avr_irq_t *input = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
    // simavr scales by 1023 where the part scales by 1024
    avr_raise_irq(input, (uint32_t)(plant_supply(bench->plant) * DIVIDER * 1000 * 1023 / 1024 + 0.5));
    return when + length;
}

static void
store(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    (void)param;
    avr->data[address] = value;
}

// Mode 10 (ICR1 is TOP) with prescaler 8 is the one that the firmware uses; in any other the motor is off.
static int
clocked(const avr_t *avr)
{
    int mode_10 = (avr->data[TCCR1A] & 3) == 2 && (avr->data[TCCR1B] & 0x18) == 0x10;
    return mode_10 && (avr->data[TCCR1B] & 7) == 2 && !(avr->data[GTCCR] & 0x80) && word(ICR1L) > 0;
}

static void
start_or_stop(avr_t *avr)
{
    if (clocked(avr) == started)
        return;
    started = !started;
    avr_cycle_timer_cancel(avr, period, NULL);
    int until_top = (word(ICR1L) - word(TCNT1L)) * PRESCALER;
    avr_cycle_timer_register(avr, started ? (avr_cycle_count_t)until_top : IDLE_PERIOD, period, NULL);
}

static void
store_mode(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    store(avr, address, value, param);
    if (address == TCCR1A)
        pins_mode(value >> 6 & 3, value >> 4 & 3);
    start_or_stop(avr);
}

static void
store_duty(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    store(avr, address, value, param);
    watch_duty_written();
}

// Releasing the prescalers starts both timers in the same cycle.
static void
release(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    int held = avr->data[GTCCR] & 0x80;
    store(avr, address, value, param);
    if (!held || value & 0x80)
        return;
    if (avr->data[TCCR2B] & 7) {
        avr_io_addr_t at = AVR_DATA_TO_IO(TCNT2);
        avr->io[at].w.c(avr, TCNT2, 0, avr->io[at].w.param);
        watch_clocks_started(avr->cycle);
    }
    start_or_stop(avr);
}

static void
hook(int address, avr_io_write_t function)
{
    avr_io_addr_t at = AVR_DATA_TO_IO(address);
    bench->avr->io[at].w.c = function;
    bench->avr->io[at].w.param = NULL;
}

void
timer1_setup(struct bench *b)
{
    bench = b;
    hook(TCCR1A, store_mode);
    hook(TCCR1B, store_mode);
    for (int address = TCNT1L; address <= OCR1BL + 1; ++address)
        hook(address, store);
    hook(OCR1AL, store_duty);
    hook(OCR1BL, store_duty);
    hook(GTCCR, release);
}

void
timer1_reset(struct bench *b)
{
    started = 0;
    for (int address = TCCR1A; address <= OCR1BL + 1; ++address)
        b->avr->data[address] = 0;
    avr_cycle_timer_register(b->avr, IDLE_PERIOD, period, NULL);
}
