/* The equations of motion M(t, q, p) qdd = f(t, q, qd, u, p), evaluated and solved.

   Functions that return bool return false when there is no finite result; instance->failure then tells why. */
#ifndef EQUATIONS_H
#define EQUATIONS_H

#include "instance.h"

/* In the phase of solving the start: solves for the start values that constraints determine. In other phases does
   nothing. All that reads states calls this first. */
bool equations_settle(Instance *instance);

/* Brings coordinates without mass up to date with the other states, unless solver steps have done so already. */
bool equations_massless(Instance *instance);

/* These bring one part of the cache up to date with the State. */
void equations_dependent(Instance *instance);
bool equations_accelerations(Instance *instance);
bool equations_multipliers(Instance *instance); /* as they are shown */
bool equations_locals(Instance *instance);
bool equations_indicators(Instance *instance);
bool equations_factorize(Instance *instance); /* the system behind the accelerations, for all seeds */

/* Adds to the seed how coordinates without mass answer to it; in the phase of solving the start, how all start values
   answer that constraints determine. */
bool equations_settle_seed(Instance *instance, Seed *seed);

/* The tangent of the dependent parameters, of accelerations and further rates, and of the locals behind these, at the
   present point along the seed. */
void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent);
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent);
void equations_locals_tangent(const Instance *instance, const Seed *seed, Tangent *tangent);

/* At the end of a step: keeps the accelerations, where the policy asks for that; at singular positions they lead on. */
void equations_remember(Instance *instance);

/* The motion with derivatives of q up to the order 2 + order, which is -1 to 2, and behind it those of the locals up to
   order. The inputs move with their present derivatives. */
bool equations_motion(Instance *instance, int order, Motion *motion);
void equations_locals_motion(Instance *instance, int order, Motion *motion);

#endif
