// Runs the plan: experiments one after the other, and everything that stops the motor.
//
// The tick interrupt owns the run. The main loop prepares the next experiment in the spare place while the
// current one runs, and may ask for a stop or a skip.

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "adc.h" // adc_sum
#include "bridge.h"
#include "config.h"
#include "encoder.h" // encoder_illegal
#include "events.h"
#include "experiment.h"
#include "pwm.h" // pwm_set
#include "runner.h"
#include "tick.h"

struct limits runner_limits = {TRAVEL_LIMIT_COUNTS, TIME_LIMIT_ms, SUPPLY_MIN_mV};
uint8_t runner_drive = BRAKE;

static volatile uint8_t running;
static volatile uint8_t starting;     // the next sample is the run's first
static volatile uint8_t stop_reason;  // asked for by the main loop; 0 = none
static volatile uint8_t skip;         // end this segment early
static volatile uint8_t spare_ready;  // the spare holds the next experiment
static volatile uint8_t plan_over;    // there is no next experiment

static struct experiment places[2];
static struct experiment *volatile active = &places[0], *volatile spare = &places[1];

static uint8_t segment;
static uint16_t tick;         // of the segment's next sample
static uint32_t run_ticks;    // samples since the run began
static uint32_t run_ms;
static int32_t start_count;
static int32_t sample_count;  // at the previous sample
static int32_t watched_count; // at the previous ms
static uint16_t still_ms;     // at STALL_DUTY or more since the last count
static int16_t duty_now;
static uint16_t supply_min;   // as adc_sum

static uint8_t next_slot, rested; // main loop: where preparation stands

uint8_t
runner_running(void)
{
    return running;
}

// Prepare what comes next in the plan. Called by the main loop.
static void
prepare(struct experiment *e)
{
    const struct slot *slot = &plan[next_slot];
    e->slot = next_slot;
    if (slot->rest && !rested) {
        experiment_rest(e, slot->rest);
        rested = 1;
        return;
    }
    experiment_prepare(e, slot);
    rested = 0;
    ++next_slot;
}

// Run the whole plan from the next tick on. Called by the main loop with a plan of at least one slot.
void
runner_start(void)
{
    next_slot = 0;
    rested = 0;
    prepare(active);
    spare_ready = 0;
    plan_over = 0;
    stop_reason = 0;
    skip = 0;
    segment = 0;
    tick = 0;
    run_ticks = 0;
    run_ms = 0;
    still_ms = 0;
    duty_now = 0;
    events_lost = 0;
    supply_min = adc_from_mV(runner_limits.supply_mV);
    runner_poll();
    bridge_enable(runner_drive);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        encoder_illegal = 0;
        starting = 1;
        running = 1;
        tick_restart();
    }
}

void
runner_stop(uint8_t reason)
{
    stop_reason = reason;
}

void
runner_skip(void)
{
    skip = 1;
}

// Keep the spare place filled. Called by the main loop.
void
runner_poll(void)
{
    if (spare_ready || plan_over)
        return;
    if (next_slot == plan_count) {
        plan_over = 1;
    } else {
        prepare(spare);
        spare_ready = 1;
    }
}

static void
begin_segment(void)
{
    events_put(&(struct event){
        .kind = SEGMENT_BEGIN,
        .segment = segment,
        .length = active->ticks,
        .slot = active->slot,
        .experiment = active->kind,
        .ticks = run_ticks,
    });
}

static void
end_segment(uint8_t reason, uint16_t length, int32_t count)
{
    events_put(&(struct event){
        .kind = SEGMENT_END,
        .segment = segment,
        .length = length,
        .reason = reason,
        .count = count,
    });
}

static void
end_run(uint8_t segment_reason, uint8_t reason, int32_t count)
{
    bridge_stop();
    end_segment(segment_reason, tick, count);
    events_put(&(struct event){.kind = RUN_END, .segment = segment, .reason = reason, .ticks = run_ticks});
    running = 0;
}

// One sample: `count` was just latched, now the duty is set, then everything that can wait. Called by the
// tick interrupt with interrupts off; they are on again once the duty is set.
void
runner_sample(int32_t count)
{
    if (!running)
        return;
    struct experiment *now = active;
    uint16_t ended = 0;
    uint8_t reason = skip ? SKIPPED : DONE;
    if (starting) {
        start_count = sample_count = watched_count = count;
    } else if (tick == now->ticks || skip) {
        if (!spare_ready) {
            end_run(reason, plan_over ? DONE : LATE, count);
            return;
        }
        ended = tick;
        now = spare;
        spare = active;
        active = now;
    }

    int16_t duty = now->kind == LOOP ? speed_loop_duty(&now->loop, count - sample_count) : now->duty;
    pwm_set(duty);
    sei();

    if (ended) {
        end_segment(reason, ended, count);
        ++segment;
        tick = 0;
        skip = 0;
        spare_ready = 0;
    }
    if (starting || ended)
        begin_segment();
    starting = 0;
    events_put(&(struct event){.kind = SAMPLE, .segment = segment, .tick = tick, .duty = duty, .count = count});
    duty_now = duty;
    sample_count = count;
    ++tick;
    ++run_ticks;
    experiment_next(now);
}

// What stops the run, most telling first; DONE for none.
static uint8_t
fault(int32_t count)
{
    int32_t travel = count - start_count;
    if (stop_reason)
        return stop_reason;
    if (tick_host_silent_ms >= HOST_SILENT_ms)
        return HOST_SILENT;
    if (still_ms >= STALL_ms)
        return STALLED;
    if (adc_sum < supply_min)
        return LOW_SUPPLY;
    if (travel > runner_limits.travel || travel < -runner_limits.travel)
        return TRAVEL_LIMIT;
    if (run_ms >= runner_limits.time_ms)
        return TIME_LIMIT;
    return DONE;
}

// Watch over the run. Called by the tick interrupt every ms with interrupts on.
void
runner_millisecond(int32_t count)
{
    if (!running || starting)
        return;
    ++run_ms;
    if (count != watched_count)
        still_ms = 0;
    else if (duty_now >= STALL_DUTY || duty_now <= -STALL_DUTY)
        ++still_ms;
    watched_count = count;
    uint8_t reason = fault(count);
    if (reason != DONE)
        end_run(reason, reason, count);
}
