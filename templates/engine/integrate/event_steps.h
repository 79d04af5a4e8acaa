/* Events where the instance integrates: solver steps end at them. event_steps_none.c is for mechanisms without events.

   Functions that return bool return false, with instance->failure, where there is no result. */
#ifndef EVENT_STEPS_H
#define EVENT_STEPS_H

#include "solver.h"

/* Where the instance integrates: a communication step begins. */
bool events_begin(Instance *instance);

/* The trial step in scratch is good. If an event lies in it, repeats it so that it ends at the first one, exactly where
   the function that comes down is 0 after the step, and notes in the State which events are due there. *step is the
   step as it is then, of length 0 if the event is at its beginning. Shampine, Thompson, Event location for ordinary
   differential equations, Computers and Mathematics with Applications 39, 2000. */
bool events_end_step(Instance *instance, Step *step);

/* Does the motion come to an event within this span (s) of the present point, or does something slip that sticks by its
   mode? If so, the event is due here. */
bool events_at_hand(Instance *instance, double span);

/* Passes the event that the present point is at. Fails if there is no end of events at one time. */
bool events_pass(Instance *instance);

/* Which event function came down at the last event; -1 if there was none since this time (s). */
int events_latest(const State *state, double since);

#endif
