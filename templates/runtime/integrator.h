/* From the present time to the end of a communication step, in the solver's own steps. */
#ifndef INTEGRATOR_H
#define INTEGRATOR_H

#include "instance.h"

/* Advances time, states and inputs of instance->state to exactly end, s. Returns false if a step could not be
   completed; all are then those of the last one that was, and instance->failure tells why. Where the solver has gone
   beyond the end, the states stay behind until something asks for them: most communication steps then only move the
   time. Lengths of steps by Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, II.4. */
bool integrate(Instance *instance, double end);

/* Brings the states to the present time if they are behind. Returns false, with instance->failure set, if constraints
   cannot be met there. */
bool integrator_catch_up(Instance *instance);

/* The least relative tolerance that rounding allows. A huge one switches error control off. */
#define LEAST_TOLERANCE 2e-15

/* The relative tolerance: solver_tolerance if given, else that of fmi2SetupExperiment if given, else 1e-6. */
double solver_tolerance(const State *state);

#endif
