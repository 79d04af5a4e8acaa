/* Where the importer integrates: what is to be done at the ends of its steps and in its events. These are the events of
   the mechanism, and those that serve to pull states back onto the constraints. */
#ifndef IMPORTER_STEPS_H
#define IMPORTER_STEPS_H

#include "instance.h"

/* derivatives[N_CONTINUOUS] of the continuous states at the point that the importer's solver tries. Returns false, with
   instance->failure, if there are none. */
bool importer_derivatives(Instance *instance, double derivatives[]);

/* A step of the importer's solver is completed: brings what is remembered from step to step up to date, and collects
   notices; no state is changed. Returns whether an event is needed: it pulls states back that have drifted, or says
   that a force of friction has become negative. A value that cannot be solved for is reported when it is asked for. */
bool importer_completes_step(Instance *instance);

/* An event begins. */
void importer_enters_event(Instance *instance);

/* In an event: moves states that have drifted, or that changed inputs displace, onto the constraints, and brings the
   modes up to date. *changed says whether continuous states were changed. Returns false, with instance->failure, if
   that fails. */
bool importer_updates_states(Instance *instance, bool *changed);

/* The time (s) of the next event that depends on nothing but the time; HUGE_VAL if there is none. */
double importer_next_event(Instance *instance);

/* The event is over, and the importer's solver goes on. */
void importer_leaves_event(Instance *instance);

#endif
