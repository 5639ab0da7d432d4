// Lines from the host, each answered by A or N. docs/protocol.md lists them.

#include <string.h>
#include <util/atomic.h>

#include "adc.h" // adc_supply_mV
#include "commands.h"
#include "encoder.h" // encoder_count
#include "events.h" // STOPPED
#include "experiment.h" // experiment_valid
#include "line.h"
#include "plan.h"
#include "report.h" // report_hello
#include "runner.h"
#include "tick.h"
#include "uart.h"
#include "words.h"

#define LINE_MAX 80
#define ANSWER_ROOM 40
#define STATUS_ROOM 90
#define ACCEPTED 255

static char line[LINE_MAX];
static uint8_t length; // LINE_MAX: too long, skip to its end
static uint16_t bad_lines;
static char *cursor; // the next field

// The next field as a number, up to 32 bits with or without sign. Returns 0 where there is none.
static uint8_t
number(int32_t *value)
{
    if (*cursor != ' ')
        return 0;
    char *digit = ++cursor;
    uint8_t negative = *digit == '-';
    digit += negative;
    if (*digit < '0' || *digit > '9')
        return 0;
    uint32_t sum = 0;
    for (; *digit >= '0' && *digit <= '9'; ++digit)
        sum = sum * 10 + (*digit - '0');
    if (*digit && *digit != ' ')
        return 0;
    cursor = digit;
    *value = negative ? -sum : sum;
    return 1;
}

static uint8_t
number_between(int32_t *value, int32_t low, int32_t high)
{
    return number(value) && *value >= low && *value <= high;
}

static uint8_t
kind_word(uint8_t *kind)
{
    if (*cursor != ' ')
        return 0;
    char *word = cursor + 1;
    char *end = strchr(word, ' ');
    if (!end)
        return 0;
    *end = 0;
    for (*kind = 0; *kind < KINDS; ++*kind)
        if (!strcmp_P(word, word_kind(*kind)))
            break;
    *end = ' ';
    cursor = end;
    return *kind < KINDS;
}

// S id slot kind rest ticks a b c
static uint8_t
add_slot(void)
{
    int32_t index, rest, ticks, a, b, c;
    struct slot slot;
    if (!number_between(&index, 0, 255) || !kind_word(&slot.kind) || !number_between(&rest, 0, 65535)
        || !number_between(&ticks, 2, 65535) || !number(&a) || !number(&b) || !number_between(&c, -32768, 32767)
        || *cursor)
        return BAD_ARGUMENT;
    if (index > plan_count)
        return ORDER;
    if (index >= PLAN_SLOTS)
        return FULL;
    slot.rest = rest;
    slot.ticks = ticks;
    slot.a = a;
    slot.b = b;
    slot.c = c;
    if (slot.rest == 1 || !experiment_valid(&slot))
        return BAD_ARGUMENT;
    plan[index] = slot;
    plan_count = index + 1;
    return ACCEPTED;
}

// P id period_ms brake|coast as 0|1
static uint8_t
set_period(void)
{
    int32_t period, drive;
    if (!number_between(&period, 1, PERIOD_MAX_ms) || !number_between(&drive, 0, 1) || *cursor)
        return BAD_ARGUMENT;
    tick_period(period);
    runner_drive = drive;
    return ACCEPTED;
}

// L id travel_counts time_ms supply_mV
static uint8_t
set_limits(void)
{
    int32_t travel, time, supply;
    if (!number_between(&travel, 1, 0x7FFFFFFF) || !number_between(&time, 1, 0x7FFFFFFF)
        || !number_between(&supply, 0, 20000) || *cursor)
        return BAD_ARGUMENT;
    runner_limits = (struct limits){travel, time, supply};
    return ACCEPTED;
}

// G id slots
static uint8_t
go(void)
{
    int32_t slots;
    if (!number(&slots) || *cursor)
        return BAD_ARGUMENT;
    if (!plan_count)
        return EMPTY;
    if (slots != plan_count)
        return ORDER;
    if (adc_supply_mV() < runner_limits.supply_mV)
        return SUPPLY;
    line_lost = 0;
    runner_start();
    return ACCEPTED;
}

static uint8_t
set_baud(void)
{
    int32_t baud;
    if (!number(&baud) || *cursor || !uart_set_baud(baud))
        return BAD_ARGUMENT;
    return ACCEPTED;
}

// Q seq id running slots count illegal supply_mV bad_lines lost
static void
status(uint16_t id)
{
    if (!line_begin('Q', STATUS_ROOM)) {
        line_drop();
        return;
    }
    int32_t count;
    uint16_t illegal;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = encoder_count;
        illegal = encoder_illegal;
    }
    line_number(id);
    line_number(runner_running());
    line_number(plan_count);
    line_number(count);
    line_number(illegal);
    line_number(adc_supply_mV());
    line_number(bad_lines);
    line_number(line_lost);
    line_end();
}

static void
answer(uint16_t id, uint8_t result)
{
    if (!line_begin(result == ACCEPTED ? 'A' : 'N', ANSWER_ROOM)) {
        line_drop();
        return;
    }
    line_number(id);
    if (result != ACCEPTED)
        line_word(word_refusal(result));
    line_end();
}

// Commands that would change a run under way wait until it is over.
static uint8_t
act(char type)
{
    if (type == 'X' || type == 'J') {
        if (!runner_running())
            return type == 'X' ? ACCEPTED : IDLE;
        if (type == 'X')
            runner_stop(STOPPED);
        else
            runner_skip();
        return ACCEPTED;
    }
    if (!strchr("CSPLGU", type))
        return UNKNOWN;
    if (runner_running())
        return BUSY;
    switch (type) {
    case 'C': plan_count = 0; return ACCEPTED;
    case 'S': return add_slot();
    case 'P': return set_period();
    case 'L': return set_limits();
    case 'G': return go();
    default: return set_baud();
    }
}

// Check the line's sum and cut it off.
static uint8_t
sum_is_right(void)
{
    if (length < 6 || line[length - 5] != '*')
        return 0;
    uint16_t crc = 0xFFFF;
    uint8_t end = length - 5;
    for (uint8_t i = 0; i < end; ++i)
        crc = line_crc(crc, line[i]);
    for (uint8_t i = end + 1; i < length; ++i) {
        char c = line[i];
        uint8_t nibble = c >= '0' && c <= '9' ? c - '0' : c >= 'A' && c <= 'F' ? c - 'A' + 10 : 16;
        if (nibble != crc >> 12)
            return 0;
        crc <<= 4;
    }
    line[end] = 0;
    return 1;
}

static void
command(void)
{
    int32_t id = 0;
    // For a person at a serial monitor: hello and stop work without a sum.
    if (length == 1 && (line[0] == 'H' || line[0] == 'X')) {
        line[1] = 0;
    } else if (!sum_is_right()) {
        ++bad_lines;
        return;
    }
    tick_host_silent_ms = 0;
    if (line[0] == 'K')
        return;
    cursor = line + 1;
    if (*cursor && !number_between(&id, 0, 65535)) {
        ++bad_lines;
        return;
    }
    if (line[0] == 'H')
        report_hello(id);
    else if (line[0] == 'Q')
        status(id);
    else
        answer(id, act(line[0]));
}

// Collect received bytes into lines. Called by the main loop.
void
commands_poll(void)
{
    for (int16_t byte; (byte = uart_get()) >= 0;) {
        if (byte == '\r')
            continue;
        if (byte == '\n') {
            if (length && length < LINE_MAX)
                command();
            length = 0;
        } else if (length < LINE_MAX - 1) {
            line[length++] = byte;
        } else {
            length = LINE_MAX;
        }
    }
}
