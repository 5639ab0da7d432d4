// The UART: bytes to the board at the pace of the wire, bytes from it to the transport.

#include <string.h>

#include "avr_uart.h"

#include "bench.h"
#include "transport.h"

#define QUEUE 65536
#define BITS_PER_BYTE 10 // simavr counts a parity bit too

enum { UCSR0A = 0xC0, UBRR0L = 0xC4, UBRR0H = 0xC5 };

static struct bench *bench;
static char queue[QUEUE];
static unsigned head, tail;
static avr_cycle_count_t last;
static avr_uart_t *uart;

static avr_cycle_count_t
cycles_per_byte(void)
{
    const uint8_t *data = bench->avr->data;
    unsigned divisor = data[UBRR0L] | data[UBRR0H] << 8;
    return (divisor + 1) * (data[UCSR0A] & 2 ? 8 : 16) * BITS_PER_BYTE;
}

double
serial_baud(void)
{
    return (double)CLOCK_Hz * BITS_PER_BYTE / cycles_per_byte();
}

static void
sent(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    uart->cycles_per_byte = cycles_per_byte();
    last = bench->avr->cycle;
    transport_put((char)value);
}

static avr_cycle_count_t
feed(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)param;
    uart->cycles_per_byte = cycles_per_byte();
    char byte = queue[tail];
    tail = (tail + 1) % QUEUE;
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), (uint8_t)byte);
    return head != tail ? when + cycles_per_byte() : 0;
}

int
serial_feeding(void)
{
    return head != tail;
}

avr_cycle_count_t
serial_last(void)
{
    return last;
}

// Hand bytes to the board, behind those that still wait.
void
serial_feed(const char *bytes, int length)
{
    int was_empty = head == tail;
    for (int k = 0; k < length; ++k) {
        queue[head] = bytes[k];
        head = (head + 1) % QUEUE;
    }
    if (was_empty && length)
        avr_cycle_timer_register(bench->avr, cycles_per_byte(), feed, NULL);
    if (length && bytes[0] != 'K')
        last = bench->avr->cycle;
}

void
serial_setup(struct bench *b)
{
    bench = b;
    avr_t *avr = b->avr;
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "uart"))
            uart = (avr_uart_t *)io;
    uint32_t flags = 0; // neither sleep on polling nor print
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);
}

void
serial_reset(struct bench *b)
{
    head = tail = 0;
    last = b->avr->cycle;
}
