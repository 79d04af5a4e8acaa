/* Further states z of first order: motors, valves, filters. They stand behind q and qd in the states, and their
   derivatives are given by formulas. further_none.c is for mechanisms that have none. */
#ifndef FURTHER_H
#define FURTHER_H

#include "instance.h"

/* rates[N_FURTHER] = dz/dt at a time (s), states and inputs, with the accelerations and multipliers there. Touches no
   cache. Returns false, with instance->failure set, where one of them is not finite. */
bool further_rates(Instance *instance, double time, const double states[], const double inputs[],
                   const double unknowns[], double rates[]);

/* Are these rates finite? If not, instance->failure is set. Mechanisms that have none have no such function. */
bool further_finite(Instance *instance, double time, const double rates[]);

/* changes[N_FURTHER]: the derivatives of dz/dt along the seed, and along the changes of accelerations and multipliers
   in changed[n + m]. */
void further_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                     const double unknowns[], const Seed *seed, const double changed[], double changes[]);

#endif
