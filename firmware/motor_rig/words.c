// The words of the protocol, in flash. Each list is one string, its words ended by zeros.

#include <avr/pgmspace.h>

#include "words.h"

static const char kinds[] PROGMEM = "rest\0step\0ramp\0sine\0multisine\0chirp\0prbs\0loop";

static const char reasons[] PROGMEM =
    "done\0skipped\0stopped\0host_silent\0time_limit\0travel_limit\0stalled\0low_supply\0late";

static const char refusals[] PROGMEM = "argument\0busy\0idle\0order\0full\0empty\0supply\0unknown\0old\0plan";

const char word_running[] PROGMEM = "running", word_idle[] PROGMEM = "idle";

static const char *
nth(const char *list, uint8_t n)
{
    while (n--)
        list += strlen_P(list) + 1;
    return list;
}

// Name of an `enum kind`.
const char *
word_kind(uint8_t kind)
{
    return nth(kinds, kind);
}

// Name of an `enum reason`.
const char *
word_reason(uint8_t reason)
{
    return nth(reasons, reason);
}

// Name of an `enum refusal`.
const char *
word_refusal(uint8_t refusal)
{
    return nth(refusals, refusal);
}
