// The queue from the tick interrupt to the main loop. One writer, one reader: no locks.

#include "events.h"

#define SIZE 16

// Slots that may be in use when an event of each kind comes: samples leave room for begins and ends, and these
// for the end of the run, which is never lost.
static const uint8_t most_used[] = {[SAMPLE] = 11, [SEGMENT_BEGIN] = 13, [SEGMENT_END] = 13, [RUN_END] = 15};

volatile uint16_t events_lost;

static struct event queue[SIZE];
static volatile uint8_t head, tail;

// Called by the tick interrupt. What finds the queue full is dropped and counted.
void
events_put(const struct event *event)
{
    uint8_t used = (uint8_t)(head - tail) % SIZE;
    if (used >= most_used[event->kind]) {
        ++events_lost;
        return;
    }
    queue[head] = *event;
    head = (head + 1) % SIZE;
}

uint8_t
events_waiting(void)
{
    return head != tail;
}

// The oldest event, which stays until events_drop. Called by the main loop when events_waiting.
const struct event *
events_first(void)
{
    return &queue[tail];
}

void
events_drop(void)
{
    tail = (tail + 1) % SIZE;
}
