// Lines that the board sends of its own: hello, and what happens during a run.

#include "adc.h" // adc_supply_mV
#include "config.h"
#include "encoder.h" // encoder_illegal
#include "events.h"
#include "line.h"
#include "plan.h" // PLAN_SLOTS
#include "pwm.h" // FULL_SCALE
#include "report.h"
#include "reset.h"
#include "runner.h" // runner_run
#include "timer.h"
#include "uart.h" // uart_room
#include "words.h"

#include <util/atomic.h>

// The longest lines of each type; test_protocol.py compares them with what comes.
#define HELLO_ROOM 120
#define EVENT_ROOM 90
#define SAMPLE_ROOM 56
// A sample leaves this free, so that ends and answers find room when samples are being dropped.
#define SAMPLE_LEAVES 90
#define SUPPLY_EVERY_ms 100

#define STRING(x) #x
#define VALUE(x) STRING(x)

static uint8_t hello_part; // next part to send; 0 = none
static uint16_t hello_id;
static uint8_t since_supply; // ms, in steps of the period

static const char hello_1[] PROGMEM =
    " 1/4 protocol=" VALUE(PROTOCOL_VERSION) " firmware=" FIRMWARE_VERSION " clock_Hz=" VALUE(F_CPU)
    " tick_us=" VALUE(TICK_us) " period_max=" VALUE(PERIOD_MAX_ms);
static const char hello_2[] PROGMEM = " 2/4 full_scale=" VALUE(FULL_SCALE) " pwm_Hz=" VALUE(PWM_Hz)
    " duty_delay_us=" VALUE(DUTY_DELAY_us) " counts_per_rev_milli=";
static const char hello_3[] PROGMEM = " 3/4 slots=" VALUE(PLAN_SLOTS) " tones=8 host_silent_ms=" VALUE(HOST_SILENT_ms)
    " stall_ms=" VALUE(STALL_ms) " stall_duty=" VALUE(STALL_DUTY);
static const char hello_4[] PROGMEM = " 4/4 adc_step_uV=";
static const char hello_supply[] PROGMEM = " supply_mV=";
static const char hello_minimum[] PROGMEM = " supply_min_mV=" VALUE(SUPPLY_MIN_mV);
static const char hello_reset[] PROGMEM = " reset=";
static const char hello_run[] PROGMEM = " run=";

// Send the hello, in four lines as room allows.
void
report_hello(uint16_t id)
{
    hello_id = id;
    hello_part = 1;
}

// `key=` is in flash, the number follows it without the space that line_number would put.
static void
key_value(const char *key, uint32_t value)
{
    line_text(key);
    line_digits(value);
}

static void
hello(void)
{
    if (!line_begin('H', HELLO_ROOM))
        return;
    line_number(hello_id);
    switch (hello_part++) {
    case 1: line_text(hello_1); break;
    case 2: key_value(hello_2, COUNTS_PER_REV_MILLI); break;
    case 3: line_text(hello_3); break;
    default:
        key_value(hello_4, (DIVIDER_TOP_OHM + DIVIDER_BOTTOM_OHM) * REFERENCE_mV / 1024 * 1000 / DIVIDER_BOTTOM_OHM);
        key_value(hello_supply, adc_supply_mV());
        line_text(hello_minimum);
        line_text(hello_reset);
        line_text(reset_cause());
        key_value(hello_run, runner_run);
        hello_part = 0;
    }
    line_end();
}

// D seq segment tick duty count [supply_mV]
static void
sample(const struct event *event)
{
    if (!line_begin('D', SAMPLE_ROOM + SAMPLE_LEAVES)) {
        line_drop();
        return;
    }
    line_number(event->segment);
    line_number(event->tick);
    line_number(event->duty);
    line_number(event->count);
    since_supply += timer_period;
    if (since_supply >= SUPPLY_EVERY_ms) {
        since_supply = 0;
        line_number(adc_supply_mV());
    }
    line_end();
}

static void
losses(void)
{
    uint16_t illegal, lost;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        illegal = encoder_illegal;
        lost = events_lost;
    }
    line_number(illegal);
    line_number((uint16_t)(lost + line_lost));
}

// B seq run segment slot kind start ticks
// E seq run segment reason ticks count illegal lost
// Z seq run reason ticks illegal lost
static uint8_t
milestone(const struct event *event)
{
    static const char types[] PROGMEM = " BEZ";
    if (!line_begin(pgm_read_byte(&types[event->kind]), EVENT_ROOM))
        return 0;
    line_unsigned(runner_run);
    switch (event->kind) {
    case SEGMENT_BEGIN:
        line_number(event->segment);
        line_number(event->slot);
        line_word(word_kind(event->experiment));
        line_number(event->ticks);
        line_number(event->length);
        break;
    case SEGMENT_END:
        line_number(event->segment);
        line_word(word_reason(event->reason));
        line_number(event->length);
        line_number(event->count);
        losses();
        break;
    case RUN_END:
        line_word(word_reason(event->reason));
        line_number(event->ticks);
        losses();
        break;
    }
    line_end();
    return 1;
}

// Send what there is. Called by the main loop.
void
report_poll(void)
{
    if (hello_part)
        hello();
    while (events_waiting()) {
        const struct event *event = events_first();
        if (event->kind == SAMPLE)
            sample(event);
        else if (!milestone(event))
            return;
        events_drop();
    }
}

uint8_t
report_waiting(void)
{
    return events_waiting() || hello_part;
}
