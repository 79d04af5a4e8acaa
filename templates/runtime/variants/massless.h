/* Coordinates without mass: the forces on them are in equilibrium, which determines where they are, or with friction
   how fast they move. Where the importer integrates they are no states, and are solved for whenever something else has
   changed. massless_none.c is for mechanisms that have none. */
#ifndef MASSLESS_H
#define MASSLESS_H

#include "instance.h"

/* Solves for them near where they were at the last completed step, if anything has changed, by Newton's method; the
   states proper stay as they are. Returns false, with instance->failure, if there is no solution. */
bool massless_settle(Instance *instance);

/* A step or an event begins or ends: makes where they are now the place from which they are sought. */
void massless_keep(State *state);

/* What has no mass gives way to a force at once, and takes along what hangs on it but for what has mass: after a change
   of inputs or parameters in an event it has to be sought, by a projection in the metric M, from where it was before.
   Returns whether that is so, and then puts it back to that place, whatever was solved since. */
bool massless_return(Instance *instance);

/* Where a solver step has failed for its error: puts forces that hardly depend on what has no mass in the place of the
   error as the reason. */
void massless_explain_failure(Instance *instance);

/* Completes a seed of states, inputs, time and parameters by how they answer; the accelerations in the cache are up to
   date. Returns false, with instance->failure, if they give no definite answer. */
bool massless_settle_seed(Instance *instance, Seed *seed);

#endif
