// Runs the plan: experiments one after the other, and everything that stops the motor.
//
// The tick interrupt owns the run. The main loop prepares the next experiment in the spare place while the
// current one runs, and may ask for a stop or a skip.

#include <avr/interrupt.h>
#include <stdlib.h> // labs
#include <util/atomic.h>

#include "adc.h" // adc_sum
#include "bridge.h"
#include "config.h"
#include "encoder.h" // encoder_illegal
#include "events.h"
#include "experiment.h"
#include "pwm.h" // pwm_set
#include "runner.h"
#include "timer.h"

struct limits runner_limits = {TRAVEL_LIMIT_COUNTS, TIME_LIMIT_ms, SUPPLY_MIN_mV};
uint8_t runner_drive = BRAKE;
uint32_t runner_run;
uint32_t runner_ticks;
uint8_t runner_ended;

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
static uint32_t run_ms;
static int32_t start_count;
static int32_t sample_count;  // at the previous sample
static int32_t still_count;   // where the shaft has been near, within STALL_COUNTS
static uint16_t still_ms;     // at STALL_DUTY or more since it came there
static int16_t duty_now;
static uint16_t supply_min;   // as adc_sum

static uint8_t next_slot, rested; // main loop: where preparation stands

// Until the run's end has been told, too: what is told of it must not change.
uint8_t
runner_busy(void)
{
    return running || events_waiting();
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
runner_start(uint32_t run)
{
    runner_run = run;
    next_slot = 0;
    rested = 0;
    prepare(active);
    spare_ready = 0;
    plan_over = 0;
    stop_reason = 0;
    skip = 0;
    segment = 0;
    tick = 0;
    runner_ticks = 0;
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
        timer_restart();
    }
}

void
runner_stop(uint8_t reason)
{
    stop_reason = reason;
}

// Does nothing when `which` is not the segment under way.
void
runner_skip(uint8_t which)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (running && segment == which)
            skip = 1;
    }
}

// How long the slot's rest and its experiment ran. Called by the main loop while the plan is the one that was run.
struct ran
runner_ran(uint8_t slot)
{
    struct ran ran = {0, 0};
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        const struct experiment *now = active;
        if (slot <= now->slot)
            ran = (struct ran){plan[slot].rest, plan[slot].ticks};
        if (slot == now->slot) {
            if (now->before)
                ran.experiment = 0;
            if (running)
                *(now->before ? &ran.rest : &ran.experiment) = tick;
        }
    }
    return ran;
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
        .ticks = runner_ticks,
    });
}

static void
end_segment(const struct experiment *ended, uint8_t reason, uint16_t length, int32_t count)
{
    *(ended->before ? &plan[ended->slot].rest : &plan[ended->slot].ticks) = length;
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
    end_segment(active, segment_reason, tick, count);
    events_put(&(struct event){.kind = RUN_END, .segment = segment, .reason = reason, .ticks = runner_ticks});
    runner_ended = reason;
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
        start_count = sample_count = still_count = count;
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
        end_segment(spare, reason, ended, count);
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
    ++runner_ticks;
    experiment_next(now);
}

// What stops the run, most telling first; DONE for none.
static uint8_t
fault(int32_t count)
{
    int32_t travel = count - start_count;
    if (stop_reason)
        return stop_reason;
    if (timer_host_silent_ms >= HOST_SILENT_ms)
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
    if (labs(count - still_count) > STALL_COUNTS) {
        still_count = count;
        still_ms = 0;
    } else if (duty_now >= STALL_DUTY || duty_now <= -STALL_DUTY) {
        ++still_ms;
    }
    uint8_t reason = fault(count);
    if (reason != DONE)
        end_run(reason, reason, count);
}
