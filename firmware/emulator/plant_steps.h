// The two halves of plant_hold, for who reads the plant in mid-hold.

#ifndef PLANT_STEPS_H
#define PLANT_STEPS_H

#include "plant.h"

// Queue one hold that begins at `at` [s].
void plant_queue(struct plant *plant, double at, double duty, int drive, double seconds);

// Integrate to `end` [s].
void plant_advance(struct plant *plant, double end);

// Frequency of the pulses [Hz], 0 where the plant takes duties as mean voltages.
double plant_pulse_rate(const struct plant *plant);

#endif
