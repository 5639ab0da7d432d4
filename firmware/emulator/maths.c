// The few functions the plant needs, written out: a recording must not depend on the C library's last digit.

#include "maths.h"

// Taylor series on a quarter turn around zero; error below 1e-14.
double
maths_sin(double x)
{
    double turns = x * (0.5 / PI);
    turns -= maths_floor(turns + 0.5); // -1/2 .. 1/2
    if (turns > 0.25)
        turns = 0.5 - turns;
    else if (turns < -0.25)
        turns = -0.5 - turns;
    double y = turns * (2 * PI), z = y * y;
    double sum = 1 - z / 306 * (1 - z / 380 * (1 - z / 506));
    sum = 1 - z / 156 * (1 - z / 210 * (1 - z / 272 * sum));
    return y * (1 - z / 6 * (1 - z / 20 * (1 - z / 42 * (1 - z / 72 * (1 - z / 110 * sum)))));
}

// Halve until small, series, square as often; error below 1e-13 for |x| < 20.
double
maths_exp(double x)
{
    if (x < -700)
        return 0;
    int halvings = 0;
    for (double size = x < 0 ? -x : x; size > 0.25; size *= 0.5)
        ++halvings;
    for (int k = 0; k < halvings; ++k)
        x *= 0.5;
    double sum = 1;
    for (int k = 12; k > 0; --k)
        sum = 1 + x / k * sum;
    for (int k = 0; k < halvings; ++k)
        sum *= sum;
    return sum;
}

// Vigna's splitmix64 (public domain).
static uint64_t
next(struct random *r)
{
    uint64_t z = r->state += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

double
random_uniform(struct random *r)
{
    return (double)(next(r) >> 11) * 0x1p-53;
}

// The sum of twelve uniform numbers: normal enough for a wandering torque, and without logarithms.
double
random_normal(struct random *r)
{
    double sum = -6;
    for (int k = 0; k < 12; ++k)
        sum += random_uniform(r);
    return sum;
}
