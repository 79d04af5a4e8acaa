/* Coordinates without mass: the forces on them are in equilibrium, which determines where they are, or with friction
   how fast they move. In model exchange they are no states and are solved for whenever something else has changed. */
#ifndef MASSLESS_H
#define MASSLESS_H

#include "equations.h"

/* Solves for them near where they were at the last completed step, if anything has changed, by Newton's method; the
   states proper stay as they are. Returns false, with instance->failure, if there is no solution. */
bool massless_settle(Instance *instance);

/* Makes where they are now the place from which they are sought. */
void massless_keep(State *state);

/* Puts them back to that place, whatever was solved since. */
void massless_return(State *state);

/* Where a solver step has failed for its error: puts forces that hardly depend on what has no mass in the place of the
   error as the reason. */
void massless_explain_failure(Instance *instance);

/* Completes a seed of states, inputs, time and parameters by how they answer; false if they give no definite answer. */
bool massless_settle_seed(Instance *instance, Seed *seed);

#endif
