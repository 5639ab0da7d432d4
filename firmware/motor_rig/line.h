// One line out: type, sequence number, fields, checksum.
//
//   D 4711 3 417 -102 15321*458E
//
// The checksum is CRC-16 (polynomial 1021, start FFFF) over everything before the asterisk, in four hex
// digits. The number counts all lines since the reset, also those that were dropped, modulo 65536.

#ifndef LINE_H
#define LINE_H

#include <avr/pgmspace.h>
#include <stdint.h>

extern uint16_t line_lost; // lines dropped since it was last set to 0

uint8_t line_begin(char type, uint8_t room);
void line_drop(void);
void line_number(int32_t value);
void line_unsigned(uint32_t value);
void line_digits(uint32_t value);
void line_text(const char *flash);
void line_word(const char *flash);
void line_end(void);

uint16_t line_crc(uint16_t sum, char c);
uint16_t line_crc_of(uint16_t sum, const void *bytes, uint16_t length);

#endif
