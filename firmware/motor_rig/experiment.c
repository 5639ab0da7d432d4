// The experiments: one duty per sample.
//
// Amplitudes, offsets and levels are in 1/128 duty, phases in 1/2^32 turn, phase increments per sample.
//
//   kind        a                        b                  c
//   rest
//   step                                 level
//   ramp                                 first level        last level
//   sine        increment                amplitude          offset
//   multisine   increment of 1st tone    amplitude of each  tones + 256 x stride
//   chirp       first increment          change of it       amplitude
//   prbs        order + 256 x hold       amplitude          offset
//   loop        Kp + 65536 x Ki          reference                          speed_loop.h

#include "experiment.h"
#include "pwm.h" // FULL_SCALE
#include "sine.h"

#define LEVEL_MAX (FULL_SCALE * 128L)

// The shift register's feedback: new bit = last bit XOR the tap's bit. 0: no such order.
static uint8_t
prbs_tap(uint8_t order)
{
    switch (order) {
    case 5: return 3;
    case 6: return 5;
    case 7: return 6;
    case 9: return 5;
    case 10: return 7;
    case 11: return 9;
    case 15: return 14;
    default: return 0;
    }
}

static uint8_t
level_fits(int32_t level)
{
    return level >= -LEVEL_MAX && level <= LEVEL_MAX;
}

static uint8_t
swing_fits(int32_t offset, int32_t amplitude)
{
    return level_fits(amplitude) && level_fits(offset + amplitude) && level_fits(offset - amplitude);
}

// Whether the slot can run; numbers that its kind does not use are 0. Called when it is uploaded.
uint8_t
experiment_valid(const struct slot *slot)
{
    if (slot->ticks < 2)
        return 0;
    switch (slot->kind) {
    case REST: return !slot->a && !slot->b && !slot->c;
    case STEP: return !slot->a && level_fits(slot->b) && !slot->c;
    case RAMP: return !slot->a && level_fits(slot->b) && level_fits(slot->c);
    case SINE: return swing_fits(slot->c, slot->b);
    case MULTISINE: {
        uint8_t tones = slot->c;
        return level_fits(slot->b) && tones >= 1 && tones <= TONES_MAX && slot->c >> 8 > 0;
    }
    case CHIRP: return level_fits(slot->c);
    case PRBS: return swing_fits(slot->c, slot->b) && prbs_tap(slot->a) && slot->a >> 8 > 0 && slot->a >> 8 <= 255;
    case LOOP: return slot->b >= -REFERENCE_MAX && slot->b <= REFERENCE_MAX && !slot->c;
    default: return 0;
    }
}

// Level [1/128 duty] to duty, rounded, halves up.
static int16_t
level_to_duty(int32_t level)
{
    return (level + 64) >> 7;
}

// Schroeder's phases, which keep the peak of the sum low: -pi k (k - 1) / tones, in 1/65536 turn.
static void
schroeder(struct experiment *e)
{
    for (uint8_t k = 0; k < e->tones; ++k)
        e->phases[k] = -(uint16_t)((uint32_t)k * (k + 1) * 32768 / e->tones);
}

static void
compute(struct experiment *e);

// Zero duty for `ticks`. Called by the main loop.
void
experiment_rest(struct experiment *e, uint16_t ticks)
{
    e->kind = REST;
    e->before = 1;
    e->ticks = ticks;
    e->duty = 0;
}

// Set up the experiment and its first duty. Called by the main loop while the previous one runs.
void
experiment_prepare(struct experiment *e, const struct slot *slot)
{
    e->kind = slot->kind;
    e->before = 0;
    e->ticks = slot->ticks;
    e->duty = 0;
    e->phase = 0;
    e->increment = slot->a;
    e->amplitude = slot->b;
    e->offset = slot->c;
    e->slope = 0;
    switch (e->kind) {
    case STEP:
        e->duty = level_to_duty(slot->b);
        return;
    case RAMP: // in 1/2^21 duty, so that the increment's rounding does not show
        e->offset = slot->b << 14;
        e->slope = ((slot->c - slot->b) << 14) / (int32_t)slot->ticks;
        break;
    case CHIRP:
        e->slope = slot->b;
        e->amplitude = slot->c;
        e->offset = 0;
        break;
    case MULTISINE:
        e->tones = slot->c;
        e->stride = slot->c >> 8;
        schroeder(e);
        break;
    case PRBS:
        e->order = slot->a;
        e->hold = e->left = slot->a >> 8;
        e->tap = prbs_tap(e->order);
        e->shift_register = (1U << e->order) - 1;
        break;
    case LOOP:
        e->loop = (struct speed_loop){.reference = slot->b, .kp = slot->a, .ki = slot->a >> 16};
        return;
    }
    compute(e);
}

static int16_t
clip(int16_t duty)
{
    return duty > FULL_SCALE ? FULL_SCALE : duty < -FULL_SCALE ? -FULL_SCALE : duty;
}

static int16_t
sine_duty(struct experiment *e)
{
    int32_t value = e->amplitude * sine(e->phase >> 16) + (e->offset << 15);
    e->phase += e->increment;
    e->increment += e->slope;
    return (value + (1L << 21)) >> 22;
}

static int16_t
multisine_duty(struct experiment *e)
{
    int32_t sum = 0;
    uint32_t phase = e->phase;
    uint32_t step = phase * e->stride;
    for (uint8_t k = 0; k < e->tones; ++k) {
        sum += sine((phase >> 16) + e->phases[k]);
        phase += step;
    }
    e->phase += e->increment;
    return clip((e->amplitude * (sum >> 3) + (1L << 18)) >> 19);
}

static int16_t
ramp_duty(struct experiment *e)
{
    int16_t duty = (e->offset + (1L << 20)) >> 21;
    e->offset += e->slope;
    return duty;
}

static int16_t
prbs_duty(struct experiment *e)
{
    uint16_t bits = e->shift_register;
    int16_t duty = level_to_duty(bits & 1 ? e->offset + e->amplitude : e->offset - e->amplitude);
    if (--e->left == 0) {
        uint8_t bit = (bits >> (e->order - 1) ^ bits >> (e->tap - 1)) & 1;
        e->shift_register = (bits << 1 | bit) & ((1U << e->order) - 1);
        e->left = e->hold;
    }
    return duty;
}

static void
compute(struct experiment *e)
{
    switch (e->kind) {
    case SINE:
    case CHIRP: e->duty = sine_duty(e); break;
    case MULTISINE: e->duty = multisine_duty(e); break;
    case RAMP: e->duty = ramp_duty(e); break;
    case PRBS: e->duty = prbs_duty(e); break;
    case LOOP: speed_loop_integrate(&e->loop); break;
    }
}

// Compute the duty of the next sample. Called by the tick interrupt after it has set this sample's, with
// interrupts on.
void
experiment_next(struct experiment *e)
{
    compute(e);
}
