/* The sizes of event functions, and up to which value they count as 0. */
#ifndef EVENT_NOISE_H
#define EVENT_NOISE_H

#include "instance.h"

/* The typical size of the event function k, in its unit: a gap, velocity or force. */
double events_size(const Instance *instance, int k);

/* What counts as 0 of the event function k: rounding beside its typical size, and what was left of it at its last
   event. */
double events_noise(const Instance *instance, int k);

/* To be called when the pending event is passed: what is left of its functions counts as 0 from now on. The rests of an
   event in a trial step that is given up are never taken. */
void events_take_rests(State *state);

#endif
