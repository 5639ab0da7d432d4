// Lines that the board sends of its own: hello, and what happens during a run.

#ifndef REPORT_H
#define REPORT_H

#include <stdint.h>

#define PROTOCOL_VERSION 2
#define FIRMWARE_VERSION "2.0.0"

void report_hello(uint16_t id);
void report_poll(void);
uint8_t report_waiting(void);

#endif
