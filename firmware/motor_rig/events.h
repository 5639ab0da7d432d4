// The queue from the tick interrupt to the main loop: samples, and where segments and the run begin and end,
// in one line, so that nothing can overtake.

#ifndef EVENTS_H
#define EVENTS_H

#include <stdint.h>

enum event_kind { SAMPLE, SEGMENT_BEGIN, SEGMENT_END, RUN_END };

// Why a segment or the run ended. protocol.c has the words.
enum reason {
    DONE,
    SKIPPED,
    STOPPED,
    HOST_SILENT,
    TIME_LIMIT,
    TRAVEL_LIMIT,
    STALLED,
    LOW_SUPPLY,
    LATE,
};

struct event {
    uint8_t kind, segment;
    union {
        uint16_t tick;   // SAMPLE: within the segment
        uint16_t length; // SEGMENT_BEGIN, SEGMENT_END: ticks of the segment
    };
    union {
        int16_t duty;    // SAMPLE
        struct {
            uint8_t slot, experiment; // SEGMENT_BEGIN
        };
        uint8_t reason;  // SEGMENT_END, RUN_END
    };
    union {
        int32_t count;   // SAMPLE, SEGMENT_END
        uint32_t ticks;  // SEGMENT_BEGIN, RUN_END: since the run began
    };
};

extern volatile uint16_t events_lost; // samples, begins and ends that found the queue full

void events_put(const struct event *event);
uint8_t events_waiting(void);
const struct event *events_first(void);
void events_drop(void);

#endif
