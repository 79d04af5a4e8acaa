/* The values of switches beside the present time. */
#ifndef TIMED_SWITCHES_H
#define TIMED_SWITCHES_H

#include "instance.h"

/* values[N_SWITCHES] of the switches at another time (s) with the present states, as events_evaluate gives them.
   Returns false, with instance->failure, if one has no finite value. */
bool switches_evaluate(Instance *instance, double time, double values[]);

#endif
