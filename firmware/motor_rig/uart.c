// Serial port: two rings, both emptied or filled by interrupts. Nothing here waits.

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "config.h" // BAUD
#include "uart.h"

#define RX_SIZE 64

static volatile char tx[256]; // 256, so that its indices wrap by themselves
static volatile uint8_t tx_head, tx_tail;
static uint8_t tx_open; // tx_head of the line that is being written
static volatile char rx[RX_SIZE];
static volatile uint8_t rx_head, rx_tail;
static uint8_t new_divisor; // takes effect when everything is sent; 0 = none

// Double speed (U2X): 16 MHz / 8 / (divisor + 1). 115200 comes out 2.1 % fast, the others are exact.
static uint8_t
divisor(uint32_t baud)
{
    switch (baud) {
    case 115200: return 16;
    case 250000: return 7;
    case 500000: return 3;
    case 1000000: return 1;
    default: return 0;
    }
}

void
uart_setup(void)
{
    UCSR0A = (1 << U2X0);
    UBRR0 = divisor(BAUD);
    UCSR0C = (1 << UCSZ01) | (1 << UCSZ00);
    UCSR0B = (1 << RXEN0) | (1 << TXEN0) | (1 << RXCIE0);
}

// Change to `baud` once the answer is out. Returns 0 for a rate that this clock cannot make.
uint8_t
uart_set_baud(uint32_t baud)
{
    return new_divisor = divisor(baud);
}

// Called by the main loop. TXC0 says that the last byte's stop bit is out.
void
uart_baud_poll(void)
{
    if (new_divisor && tx_head == tx_tail && (UCSR0A & (1 << TXC0))) {
        UBRR0 = new_divisor;
        new_divisor = 0;
    }
}

// The next received byte, or -1.
int16_t
uart_get(void)
{
    uint8_t tail = rx_tail;
    if (tail == rx_head)
        return -1;
    char c = rx[tail];
    rx_tail = (tail + 1) % RX_SIZE;
    return (uint8_t)c;
}

uint8_t
uart_waiting(void)
{
    return rx_head != rx_tail || new_divisor;
}

// Bytes that still fit. Ask before uart_put: it does not check.
uint8_t
uart_room(void)
{
    return tx_tail - tx_open - 1;
}

void
uart_put(char c)
{
    tx[tx_open++] = c;
}

// Hand what was put since the last uart_send to the interrupt.
void
uart_send(void)
{
    UCSR0A |= (1 << TXC0); // writing one clears it, for uart_baud_poll
    // Atomic: an interrupt that switched UDRIE off between this line's read and write would be undone.
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        tx_head = tx_open;
        UCSR0B |= (1 << UDRIE0);
    }
}

// One byte out. At most 60 cycles, once per byte time (320 cycles at 500000 baud).
ISR(USART_UDRE_vect)
{
    uint8_t tail = tx_tail;
    UDR0 = tx[tail++];
    tx_tail = tail;
    if (tail == tx_head)
        UCSR0B &= ~(1 << UDRIE0);
}

// One byte in; dropped when the ring is full, which its line's checksum then shows. At most 70 cycles.
ISR(USART_RX_vect)
{
    char c = UDR0;
    uint8_t next = (rx_head + 1) % RX_SIZE;
    if (next != rx_tail) {
        rx[rx_head] = c;
        rx_head = next;
    }
}
