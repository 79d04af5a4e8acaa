/* Events: where the equations of motion change from one smooth form to another. Each event function is positive as long
   as the present modes may last, and an event is where one comes down to 0. Modes are the switches and masks at the
   beginning of the parameters, and the State's modes of contacts. events_none.c is for mechanisms without events.

   Functions that return bool return false, with instance->failure, where there is no result. */
#ifndef EVENTS_H
#define EVENTS_H

#include "solver.h"

/* values[N_EVENTS] of the event functions at a time (s) in a communication step and states[2n], under the modes of the
   State; 1 for a function that means nothing in the present mode. Those of switches come first, then those of contacts.
   Touches no cache. */
bool events_evaluate(Instance *instance, double time, const double states[], double values[]);

/* Chooses modes at the present point until nothing changes, and performs impacts. due[N_EVENTS]: which functions came
   down to 0 here; NULL: the instance starts, and all is decided anew. *jumped: states changed. */
bool events_settle(Instance *instance, const bool due[], bool *jumped);

/* Brings the modes up to date with what was assigned since they were settled, in the phase of solving the start
   anew. */
bool events_refresh(Instance *instance, bool *jumped);

/* *pushed: is the event function k a switch that is 0 here, but for an importer's hysteresis, and does the motion push
   it back to 0 on either side? */
bool events_push_back(Instance *instance, int k, bool *pushed);

/* An importer's solver has come to an event, which has been passed. Fails if many of them follow each other at a place
   to which the motion is pushed back from both sides, so that there is no end of them. */
bool events_go_on(Instance *instance);

/* Where the instance integrates: a communication step begins. */
bool events_begin(Instance *instance);

/* The trial step in scratch is good. If an event lies in it, repeats it so that it ends at the first one, exactly where
   the function that comes down is 0 after the step, and notes in the State which events are due there. *step is the
   step as it is then, of length 0 if the event is at its beginning. Shampine, Thompson, Event location for ordinary
   differential equations, Computers and Mathematics with Applications 39, 2000. */
bool events_end_step(Instance *instance, Step *step);

/* Does the motion come to an event within this span (s) of the present point? If so, the event is due here. */
bool events_at_hand(Instance *instance, double span);

/* Passes the event that the present point is at. Fails if there is no end of events at one time. */
bool events_pass(Instance *instance);

/* Event indicators for an importer's solver, [N_EVENTS]: event functions that are moved up a little, so that none is 0
   after an event. */
bool events_indicate(Instance *instance, double indicators[]);

/* Writes to text[size] one sentence on a failure that concerns events. */
void events_sentence(const Failure *failure, char text[], size_t size);

/* The next time (s) at which a switch that depends on nothing but the time changes; HUGE_VAL if there is none. */
double events_next_time(Instance *instance);

/* Which event function came down at the last event; -1 if there was none since this time (s). */
int events_latest(const State *state, double since);

/* What an event function belongs to, for sentences. */
const char *events_name(int k);

#endif
