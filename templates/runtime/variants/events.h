/* Events: where the equations of motion change from one smooth form to another. Each event function is positive as long
   as the present modes may last, and an event is where one comes down to 0. Modes are the switches and masks at the
   beginning of the parameters, and the State's modes of contacts. events_none.c is for mechanisms without events. */
#ifndef EVENTS_H
#define EVENTS_H

#include "instance.h"

/* values[N_EVENTS] of the event functions at a time (s) in a communication step and states[2n], under the modes of the
   State; 1 for a function that means nothing in the present mode. Those of switches come first, then those of contacts.
   Touches no cache. Returns false, with instance->failure, where they cannot be evaluated. */
bool events_evaluate(Instance *instance, double time, const double states[], double values[]);

/* Chooses modes at the present point until nothing changes, and performs impacts. due[N_EVENTS]: which functions came
   down to 0 here; NULL: the instance starts, and all is decided anew. *jumped: states changed. Returns false, with
   instance->failure, if no modes are found. */
bool events_settle(Instance *instance, const bool due[], bool *jumped);

#endif
