// The words of the protocol, in flash.

#ifndef WORDS_H
#define WORDS_H

#include <stdint.h>

enum refusal { BAD_ARGUMENT, BUSY, IDLE, ORDER, FULL, EMPTY, SUPPLY, UNKNOWN, OLD, OTHER_PLAN };

extern const char word_running[], word_idle[]; // in flash

const char *word_kind(uint8_t kind);
const char *word_reason(uint8_t reason);
const char *word_refusal(uint8_t refusal);

#endif
