// Proportional and PI speed loop, in integers that the host repeats exactly.
//
//   e[k] = clip(ref - 16 (count[k] - count[k-1]), 8191)      error, 1/16 count per sample
//   u[k] = (Kp e[k] + floor(A[k] / 256) + 2048) / 4096       rounded down; Kp in 1/256 duty per count
//   duty[k] = clip(u[k], FULL_SCALE)
//   A[k+1] = clip(A[k] + Ki e[k], FULL_SCALE 2^20)           integral, 1/2^20 duty; Ki in 1/65536
//
// The integral keeps its value where u is clipped and e has u's sign (no wind-up). A[0] = 0.
// An error enters the integral one sample later, so that only one product lies between count and duty.

#ifndef SPEED_LOOP_H
#define SPEED_LOOP_H

#include <stdint.h>

// Largest reference [1/16 count per sample]
#define REFERENCE_MAX 16384

struct speed_loop {
    int16_t reference;
    uint16_t kp, ki;
    int16_t error;
    int8_t clipped; // sign of u where it is beyond full scale, else 0
    int32_t integral;
};

int16_t speed_loop_duty(struct speed_loop *loop, int32_t difference);
void speed_loop_integrate(struct speed_loop *loop);

#endif
