// Proportional and PI speed loop, in integers that the host repeats exactly. speed_loop.h has the law.

#include "pwm.h" // FULL_SCALE
#include "speed_loop.h"

#define ERROR_MAX 8191
#define DIFFERENCE_MAX 2047 // beyond it the error is clipped whatever the reference, and 16 bits are enough
#define INTEGRAL_MAX ((int32_t)FULL_SCALE << 20)

// The duty for a count `difference` over the last period. Called by the tick interrupt between latching the
// count and setting the duty.
int16_t
speed_loop_duty(struct speed_loop *loop, int32_t difference)
{
    int16_t counts = difference > DIFFERENCE_MAX    ? DIFFERENCE_MAX
                     : difference < -DIFFERENCE_MAX ? -DIFFERENCE_MAX
                                                    : (int16_t)difference;
    int32_t error = (int32_t)loop->reference - (int16_t)(counts << 4);
    loop->error = error > ERROR_MAX ? ERROR_MAX : error < -ERROR_MAX ? -ERROR_MAX : (int16_t)error;

    int32_t u = (int32_t)loop->error * loop->kp + (loop->integral >> 8) + 2048;
    loop->clipped = u >= (FULL_SCALE + 1) * 4096L ? 1 : u < -FULL_SCALE * 4096L ? -1 : 0;
    if (loop->clipped)
        return loop->clipped > 0 ? FULL_SCALE : -FULL_SCALE;
    return (int16_t)(u >> 8) >> 4; // in two steps: a shift by 12 is a loop over 32 bits
}

// Take the error of this sample into the integral. Called by the tick interrupt after the duty is set.
void
speed_loop_integrate(struct speed_loop *loop)
{
    if ((loop->clipped > 0 && loop->error > 0) || (loop->clipped < 0 && loop->error < 0))
        return;
    int32_t integral = loop->integral + (int32_t)loop->error * loop->ki;
    loop->integral = integral > INTEGRAL_MAX    ? INTEGRAL_MAX
                     : integral < -INTEGRAL_MAX ? -INTEGRAL_MAX
                                                : integral;
}
