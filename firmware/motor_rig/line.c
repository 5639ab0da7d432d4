// One line out: type, sequence number, fields, checksum.

#include "line.h"
#include "uart.h"

uint16_t line_lost;

static uint16_t sequence;
static uint16_t crc;

// CRC-16/CCITT, one byte, without a table.
uint16_t
line_crc(uint16_t sum, char c)
{
    uint8_t x = (uint8_t)(sum >> 8) ^ (uint8_t)c;
    x ^= x >> 4;
    return (sum << 8) ^ ((uint16_t)x << 12) ^ ((uint16_t)x << 5) ^ x;
}

uint16_t
line_crc_of(uint16_t sum, const void *bytes, uint16_t length)
{
    for (const char *c = bytes; length--; ++c)
        sum = line_crc(sum, *c);
    return sum;
}

static void
put(char c)
{
    crc = line_crc(crc, c);
    uart_put(c);
}

// Begin a line that needs at most `room` bytes. Returns 0 where they are not there: the caller tries again
// later, or calls line_drop.
uint8_t
line_begin(char type, uint8_t room)
{
    if (uart_room() < room)
        return 0;
    crc = 0xFFFF;
    put(type);
    line_number(sequence++);
    return 1;
}

// Count a line that did not fit. Its number stays unused, so the host sees the gap.
void
line_drop(void)
{
    ++sequence;
    ++line_lost;
}

// `value` in decimal. Subtracts powers of ten: a 32-bit division would take 600 cycles a digit.
void
line_digits(uint32_t rest)
{
    static const uint32_t powers[] PROGMEM = {1000000000, 100000000, 10000000, 1000000, 100000};
    uint8_t begun = 0;
    if (rest >= 100000)
        for (uint8_t i = 0; i < 5; ++i) {
            uint32_t power = pgm_read_dword(&powers[i]);
            char digit = '0';
            for (; rest >= power; rest -= power)
                ++digit;
            if (begun |= digit != '0')
                put(digit);
        }
    char high = '0';
    for (; rest >= 10000; rest -= 10000) // what is left fits in 17 bits
        ++high;
    if (begun |= high != '0')
        put(high);
    uint16_t low = rest;
    for (uint16_t power = 1000; power > 1; power = power == 1000 ? 100 : power == 100 ? 10 : 1) {
        char digit = '0';
        for (; low >= power; low -= power)
            ++digit;
        if (begun |= digit != '0')
            put(digit);
    }
    put('0' + low);
}

// A space and `value`.
void
line_number(int32_t value)
{
    put(' ');
    if (value < 0) {
        put('-');
        value = -value;
    }
    line_digits(value);
}

void
line_unsigned(uint32_t value)
{
    put(' ');
    line_digits(value);
}

// A space and a word from flash.
void
line_word(const char *flash)
{
    put(' ');
    line_text(flash);
}

// Text from flash, as it is.
void
line_text(const char *flash)
{
    for (char c; (c = pgm_read_byte(flash)); ++flash)
        put(c);
}

// Checksum, newline, and off it goes.
void
line_end(void)
{
    uint16_t sum = crc;
    uart_put('*');
    for (uint8_t i = 0; i < 4; ++i) {
        uint8_t nibble = sum >> 12;
        uart_put(nibble < 10 ? '0' + nibble : 'A' - 10 + nibble);
        sum <<= 4;
    }
    uart_put('\n');
    uart_send();
}
