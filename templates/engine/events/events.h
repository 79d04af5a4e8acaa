/* Events: where the equations of motion change from one smooth form to another. Each event function is positive as long
   as the present modes may last, and an event is where one comes down to 0. Modes are the switches and masks at the
   beginning of the parameters, and the State's modes of contacts. events_none.c is for mechanisms without events.

   Functions that return bool return false, with instance->failure, where there is no result. */
#ifndef EVENTS_H
#define EVENTS_H

#include "instance.h"

/* values[N_EVENTS] of the event functions at a time (s) in a communication step and states[2n], under the modes of the
   State; 1 for a function that means nothing in the present mode. Those of switches come first, then those of contacts.
   Touches no cache. */
bool events_evaluate(Instance *instance, double time, const double states[], double values[]);

/* Chooses modes at the present point until nothing changes, and performs impacts. due[N_EVENTS]: which functions came
   down to 0 here; NULL: the instance starts, and all is decided anew. *jumped: states changed. */
bool events_settle(Instance *instance, const bool due[], bool *jumped);

/* Puts the switches on the sides of the present states, from which the start is solved: constraints may have kinks.
   Returns whether any has turned. */
bool events_take_sides(Instance *instance);

/* Brings the modes up to date with what was assigned since they were settled, in the phase of solving the start
   anew. */
bool events_refresh(Instance *instance, bool *jumped);

/* *pushed: is the event function k a switch that is 0 here, but for an importer's hysteresis, and does the motion push
   it back to 0 on either side? */
bool events_push_back(Instance *instance, int k, bool *pushed);

/* An importer's solver has come to an event, which has been passed. Fails if many of them follow each other at a place
   to which the motion is pushed back from both sides, so that there is no end of them. */
bool events_go_on(Instance *instance);

/* Event indicators for an importer's solver, [N_EVENTS]: event functions that are moved up a little, so that none is 0
   after an event. */
bool events_indicate(Instance *instance, double indicators[]);

#endif
