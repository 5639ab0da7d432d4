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
#include "timer.h"
#include "uart.h"
#include "words.h"

#define LINE_MAX 80
#define ANSWER_ROOM 40
#define STATUS_ROOM 90
#define ACCEPTED 255
#define RAN_SLOTS 4 // that an R line tells of

static char line[LINE_MAX];
static uint8_t length; // LINE_MAX: too long or no text, skip to its end
static uint16_t bad_lines;
static char *cursor; // the next field
static uint32_t claimed; // the run that the plan is for

// The next field: digits, with or without a minus. Returns 0 where there is none, or where it needs more than 32 bits.
static uint8_t
digits(uint32_t *size, uint8_t *negative)
{
    if (*cursor != ' ')
        return 0;
    char *digit = ++cursor;
    *negative = *digit == '-';
    digit += *negative;
    if (*digit < '0' || *digit > '9')
        return 0;
    uint32_t sum = 0;
    for (; *digit >= '0' && *digit <= '9'; ++digit) {
        uint8_t value = *digit - '0';
        if (sum > UINT32_MAX / 10 || (sum == UINT32_MAX / 10 && value > UINT32_MAX % 10))
            return 0;
        sum = sum * 10 + value;
    }
    if (*digit && *digit != ' ')
        return 0;
    cursor = digit;
    *size = sum;
    return 1;
}

static uint8_t
number_between(int32_t *value, int32_t low, int32_t high)
{
    uint32_t size;
    uint8_t negative;
    if (!digits(&size, &negative) || size > (uint32_t)INT32_MAX + negative)
        return 0;
    *value = negative ? -size : size;
    return *value >= low && *value <= high;
}

static uint8_t
number_unsigned(uint32_t *value)
{
    uint8_t negative;
    return digits(value, &negative) && !negative;
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

// C id run: the slots that follow are for this run. Said again it changes nothing.
static uint8_t
claim(void)
{
    uint32_t run;
    if (!number_unsigned(&run) || *cursor)
        return BAD_ARGUMENT;
    if (run <= runner_run)
        return OLD;
    if (run != claimed)
        plan_count = 0;
    claimed = run;
    return ACCEPTED;
}

// S id slot kind rest ticks a b c. Said again it changes nothing; said anew it takes back the slots behind it.
static uint8_t
add_slot(void)
{
    int32_t index, rest, ticks, b, c;
    struct slot slot;
    memset(&slot, 0, sizeof slot); // slots are compared and summed byte by byte
    if (!number_between(&index, 0, 255) || !kind_word(&slot.kind) || !number_between(&rest, 0, 65535)
        || !number_between(&ticks, 2, 65535) || !number_unsigned(&slot.a) || !number_between(&b, INT32_MIN, INT32_MAX)
        || !number_between(&c, -32768, 32767) || *cursor)
        return BAD_ARGUMENT;
    slot.rest = rest;
    slot.ticks = ticks;
    slot.b = b;
    slot.c = c;
    if (slot.rest == 1 || !experiment_valid(&slot))
        return BAD_ARGUMENT;
    if (index > plan_count || claimed == runner_run)
        return ORDER;
    if (index >= PLAN_SLOTS)
        return FULL;
    if (index < plan_count && !memcmp(&plan[index], &slot, sizeof slot))
        return ACCEPTED;
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
    timer_period = period;
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

// CRC-16 over what G starts: period, drive, limits and slots, as they lie in memory, numbers with the low byte first.
static uint16_t
plan_sum(void)
{
    uint8_t head[2] = {timer_period, runner_drive};
    uint16_t crc = line_crc_of(0xFFFF, head, sizeof head);
    crc = line_crc_of(crc, &runner_limits, sizeof runner_limits);
    return line_crc_of(crc, plan, plan_count * sizeof *plan);
}

// G id run slots sum. A run is started once, however often it is asked for.
static uint8_t
go(void)
{
    uint32_t run;
    int32_t slots, sum;
    if (!number_unsigned(&run) || !number_between(&slots, 0, 255) || !number_between(&sum, 0, 65535) || *cursor)
        return BAD_ARGUMENT;
    if (run && run == runner_run)
        return ACCEPTED;
    if (runner_busy())
        return BUSY;
    if (run <= runner_run)
        return OLD;
    if (run != claimed)
        return ORDER;
    if (!plan_count)
        return EMPTY;
    if (slots != plan_count || (uint16_t)sum != plan_sum())
        return OTHER_PLAN;
    if (adc_supply_mV() < runner_limits.supply_mV)
        return SUPPLY;
    line_lost = 0;
    runner_start(run);
    return ACCEPTED;
}

// J id run segment: end this segment now. Said again, when the next one has begun, it changes nothing.
static uint8_t
skip(void)
{
    uint32_t run;
    int32_t segment;
    if (!number_unsigned(&run) || !number_between(&segment, 0, 255) || *cursor)
        return BAD_ARGUMENT;
    if (!runner_busy() || run != runner_run)
        return IDLE;
    runner_skip(segment);
    return ACCEPTED;
}

static uint8_t
set_baud(void)
{
    uint32_t baud;
    if (!number_unsigned(&baud) || *cursor || !uart_set_baud(baud))
        return BAD_ARGUMENT;
    return ACCEPTED;
}

// Q seq id run state ticks slots count illegal supply_mV bad_lines lost
static void
status(uint16_t id)
{
    if (!line_begin('Q', STATUS_ROOM)) {
        line_drop();
        return;
    }
    int32_t count;
    uint32_t ticks;
    uint16_t illegal;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = encoder_count;
        illegal = encoder_illegal;
        ticks = runner_ticks;
    }
    line_number(id);
    line_unsigned(runner_run);
    line_word(runner_busy() ? word_running : runner_run ? word_reason(runner_ended) : word_idle);
    line_unsigned(ticks);
    line_number(plan_count);
    line_number(count);
    line_number(illegal);
    line_number(adc_supply_mV());
    line_number(bad_lines);
    line_number(line_lost);
    line_end();
}

// R seq id run slot, then for it and those behind it, as many as the line holds: ticks of rest, ticks
static void
ran(uint16_t id, uint8_t slot)
{
    if (!line_begin('R', STATUS_ROOM)) {
        line_drop();
        return;
    }
    line_number(id);
    line_unsigned(runner_run);
    line_number(slot);
    if (claimed != runner_run)
        slot = PLAN_SLOTS; // the plan is for a run that has not begun
    for (uint8_t k = 0; k < RAN_SLOTS && slot < plan_count; ++k, ++slot) {
        struct ran ticks = runner_ran(slot);
        line_number(ticks.rest);
        line_number(ticks.experiment);
    }
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
    switch (type) {
    case 'X':
        if (*cursor)
            return BAD_ARGUMENT;
        runner_stop(STOPPED);
        return ACCEPTED;
    case 'J': return skip();
    case 'G': return go();
    case 'C': case 'S': case 'P': case 'L': case 'U': break;
    default: return UNKNOWN;
    }
    if (runner_busy())
        return BUSY;
    switch (type) {
    case 'C': return claim();
    case 'S': return add_slot();
    case 'P': return set_period();
    case 'L': return set_limits();
    default: return set_baud();
    }
}

// H, Q and R have answers of their own. Returns 0 where the line is none of them, or is not as it should be.
static uint8_t
tell(char type, uint16_t id)
{
    int32_t slot;
    if (type == 'R') {
        if (!number_between(&slot, 0, PLAN_SLOTS - 1) || *cursor)
            return 0;
        ran(id, slot);
        return 1;
    }
    if ((type != 'H' && type != 'Q') || *cursor)
        return 0;
    if (type == 'H')
        report_hello(id);
    else
        status(id);
    return 1;
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
    timer_host_silent_ms = 0;
    char type = line[0];
    cursor = line + 1;
    if (type == 'K' && !*cursor)
        return;
    if (*cursor && !number_between(&id, 0, 65535)) {
        ++bad_lines;
        answer(0, BAD_ARGUMENT);
        return;
    }
    if (!tell(type, id))
        answer(id, type == 'H' || type == 'Q' || type == 'R' || type == 'K' ? BAD_ARGUMENT : act(type));
}

// Collect received bytes into lines. Called by the main loop; it goes on after each line, however many come, for the
// loop has the watchdog to feed and samples to send.
void
commands_poll(void)
{
    uint8_t line_is_done = 0;
    for (int16_t byte; !line_is_done && (byte = uart_get()) >= 0;) {
        if (byte == '\r')
            continue;
        if (byte == '\n') {
            if (length == LINE_MAX)
                ++bad_lines;
            else if (length)
                command();
            length = 0;
            line_is_done = 1;
        } else if (length < LINE_MAX - 1 && byte >= ' ' && byte <= '~') {
            line[length++] = byte;
        } else {
            length = LINE_MAX;
        }
    }
}
