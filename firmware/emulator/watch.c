// What the interrupts take: cycles of each, jitter of the tick, how long an edge waits, when the duty is set.

#include <stdio.h>
#include <string.h>

#include "bench.h"
#include "sim_interrupts.h"
#include "sim_irq.h"

#define TICK_CYCLES MS
#define TICK 7
#define UART_TX 19

static const struct vector {
    const char *name;
    int number;
} vectors[] = {{"encoder_a", 1}, {"encoder_b", 2}, {"tick", TICK}, {"uart_rx", 18}, {"uart_tx", UART_TX}};
#define VECTORS 5

static struct measure {
    uint64_t calls;
    avr_cycle_count_t began, raised, inside; // inside: spent in interrupts nested in this one
    avr_cycle_count_t longest, longest_own, longest_wait;
} measures[VECTORS];

static struct bench *bench;
static int nest[8], depth; // which interrupts are running
static avr_cycle_count_t clocks_started;
static avr_cycle_count_t tick_first = ~0ull, tick_last, duty_last;

static void
raise_to(avr_cycle_count_t *longest, avr_cycle_count_t value)
{
    if (value > *longest)
        *longest = value;
}

static void
entered(int k, struct measure *m, avr_cycle_count_t now)
{
    ++m->calls;
    m->began = now;
    m->inside = 0;
    if (m->raised)
        raise_to(&m->longest_wait, now - m->raised);
    m->raised = 0;
    if (depth < 8)
        nest[depth++] = k;
    if (vectors[k].number == TICK && clocks_started) {
        avr_cycle_count_t late = (now - clocks_started) % TICK_CYCLES;
        raise_to(&tick_last, late);
        if (late < tick_first)
            tick_first = late;
    }
}

static void
left(struct measure *m, avr_cycle_count_t now)
{
    avr_cycle_count_t took = now - m->began;
    raise_to(&m->longest, took);
    raise_to(&m->longest_own, took - m->inside);
    if (depth)
        --depth;
    if (depth)
        measures[nest[depth - 1]].inside += took;
}

static void
running(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    struct measure *m = param;
    if (value)
        entered((int)(m - measures), m, bench->avr->cycle);
    else
        left(m, bench->avr->cycle);
}

static void
pending(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    struct measure *m = param;
    if (!value)
        m->raised = 0; // served, or taken back
    else if (!m->raised)
        m->raised = bench->avr->cycle;
}

void
watch_clocks_started(avr_cycle_count_t when)
{
    clocks_started = when;
}

// Only what the tick sets is on time by promise; the main loop sets it between runs.
void
watch_duty_written(void)
{
    for (int k = 0; k < depth; ++k)
        if (vectors[nest[k]].number == TICK)
            raise_to(&duty_last, (bench->avr->cycle - clocks_started) % TICK_CYCLES);
}

void
watch_setup(struct bench *b)
{
    bench = b;
    for (int k = 0; k < VECTORS; ++k) {
        avr_irq_t *irq = avr_get_interrupt_irq(b->avr, vectors[k].number);
        avr_irq_register_notify(irq + AVR_INT_IRQ_RUNNING, running, &measures[k]);
        avr_irq_register_notify(irq + AVR_INT_IRQ_PENDING, pending, &measures[k]);
    }
}

void
watch_reset(struct bench *b)
{
    (void)b;
    depth = 0;
    clocks_started = 0;
    for (int k = 0; k < VECTORS; ++k)
        measures[k].raised = 0;
}

static void
write_measure(FILE *file, int k)
{
    const struct measure *m = &measures[k];
    fprintf(file, ", \"%s\": {\"calls\": %llu, \"cycles\": %llu, \"own_cycles\": %llu", vectors[k].name,
            (unsigned long long)m->calls, (unsigned long long)m->longest, (unsigned long long)m->longest_own);
    // An empty transmitter is raised all the time; how long it "waits" says nothing.
    if (vectors[k].number != UART_TX)
        fprintf(file, ", \"wait_cycles\": %llu", (unsigned long long)m->longest_wait);
    fprintf(file, "}");
}

// One JSON object, cycles of 62.5 ns.
void
watch_write(const struct bench *b, const char *path, double cpu_s)
{
    FILE *file = fopen(path, "w");
    if (!file) {
        fprintf(stderr, "bench: cannot write %s\n", path);
        return;
    }
    fprintf(file, "{\"simulated_s\": %.6f, \"cpu_s\": %.3f, \"stack_left_bytes\": %d",
            (double)b->avr->cycle / CLOCK_Hz, cpu_s, board_stack_left(b));
    fprintf(file, ", \"tick_first_cycle\": %llu, \"tick_last_cycle\": %llu, \"duty_last_cycle\": %llu",
            (unsigned long long)(tick_first == ~0ull ? 0 : tick_first), (unsigned long long)tick_last,
            (unsigned long long)duty_last);
    fprintf(file, ", \"plant\": {\"time_s\": %.9g, \"angle_rad\": %.17g, \"speed_rad_s\": %.9g, \"count\": %lld}",
            plant_time(b->plant), plant_angle(b->plant), plant_speed(b->plant), (long long)plant_count(b->plant));
    for (int k = 0; k < VECTORS; ++k)
        write_measure(file, k);
    fprintf(file, "}\n");
    fclose(file);
}
