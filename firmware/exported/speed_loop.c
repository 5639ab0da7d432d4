// The rig's speed loop with the controller of an exported header in it: the gains come from the header, those of the
// plan are ignored. Built by `make exported HEADER=motor.h`.
//
// The first duty of an experiment takes longer, since its reference is set then, and may act one pulse (250 us) late.

#include MOTOR_HEADER

#include "pwm.h" // FULL_SCALE
#include "speed_loop.h"

_Static_assert(MOTOR_FULL_SCALE == FULL_SCALE, "export with --full-scale 250: that is this board's");

static struct motor_speed_loop exported;
static struct speed_loop *runs; // the board's place for the experiment that runs

int16_t
speed_loop_duty(struct speed_loop *loop, int32_t difference)
{
    // The board's loop is all zero but for its numbers when an experiment begins; `clipped` marks one that has begun.
    if (!loop->clipped || loop != runs) {
        exported = (struct motor_speed_loop){0};
        motor_speed_reference(&exported, loop->reference * 16L);
        loop->clipped = 1;
        runs = loop;
    }
    return motor_speed_duty(&exported, difference * 256);
}

void
speed_loop_integrate(struct speed_loop *loop)
{
    (void)loop;
    motor_speed_integrate(&exported);
}
