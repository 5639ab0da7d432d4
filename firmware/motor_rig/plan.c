// The plan: what the host uploaded, one slot per experiment.

#include "plan.h"

struct slot plan[PLAN_SLOTS];
uint8_t plan_count;
