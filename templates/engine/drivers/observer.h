/* Where a communication step may estimate. An FMU that observes takes samples at the communication point, corrects its
   estimate by them, and goes on to the end by the equations of the mechanism; another one integrates. */
#ifndef OBSERVER_H
#define OBSERVER_H

#include "instance.h"

/* At the start, which is solved: what is known of it. Returns false, with instance->failure, if no state near it meets
   the constraints. */
bool observer_begin(Instance *instance);

/* A communication step to the end (s). Returns false, with instance->failure, if there is no estimate; an observer then
   stays where it was. */
bool observer_advance(Instance *instance, double end);

#endif
