// Serial port: two rings, both emptied or filled by interrupts. Nothing here waits.

#ifndef UART_H
#define UART_H

#include <stdint.h>

void uart_setup(void);
uint8_t uart_set_baud(uint32_t baud);
void uart_baud_poll(void);

int16_t uart_get(void);
uint8_t uart_waiting(void);

uint8_t uart_room(void);
void uart_put(char c);
void uart_send(void);

#endif
