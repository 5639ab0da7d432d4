// The few functions the plant needs, written out: a recording must not depend on the C library's last digit.

#ifndef MATHS_H
#define MATHS_H

#include <stdint.h>

#define PI 3.14159265358979323846

double maths_sin(double x);
double maths_exp(double x);

// Rounded down. Within +-2^53.
static inline double
maths_floor(double x)
{
    double whole = (double)(int64_t)x;
    return whole > x ? whole - 1 : whole;
}

// Random numbers: the same for a seed on every machine.
struct random {
    uint64_t state;
};

double random_uniform(struct random *r); // 0 <= x < 1
double random_normal(struct random *r);  // mean 0, variance 1

#endif
