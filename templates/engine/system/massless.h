/* Coordinates without mass: the forces on them are in equilibrium, which determines where they are, or with friction
   how fast they move. Where the importer integrates they are no states, and are solved for whenever something else has
   changed. massless_none.c is for mechanisms that have none. */
#ifndef MASSLESS_H
#define MASSLESS_H

#include "instance.h"

/* Solves for the coordinates without mass near where they were at the last completed step, if anything has changed, by
   Newton's method; the states proper stay as they are. Returns false, with instance->failure, if there is no solution.
   */
bool massless_settle(Instance *instance);

/* To be called where a step or an event begins or ends: from now on coordinates without mass are sought from where they
   are at present. */
void massless_keep(State *state);

/* Do coordinates without mass have to be sought anew in an event? They give way to a force at once. After a change of
   inputs or parameters a projection in the metric M finds them from where they were before. If so, puts them back to
   that place, whatever was solved since, and returns true. */
bool massless_return(Instance *instance);

/* After a solver step has failed for its error: names it as the reason if forces hardly depend on a coordinate without
   mass. */
void massless_explain_failure(Instance *instance);

/* Adds to a seed of states, inputs, time and parameters how what has no mass answers; the accelerations in the cache
   are up to date. Returns false, with instance->failure, if there is no definite answer. */
bool massless_settle_seed(Instance *instance, Seed *seed);

/* Says in instance->failure that the first `size` coordinates without mass do not follow, and what is left of their
   equations: residuals[m]. Returns false. */
bool massless_report(Instance *instance, const double residuals[], int size);

#endif
