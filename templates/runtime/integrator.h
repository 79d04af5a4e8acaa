/* From the present time to the end of a communication step, in the solver's own steps. */
#ifndef INTEGRATOR_H
#define INTEGRATOR_H

#include "instance.h"

/* Advances time, states and inputs of instance->state to exactly end, s. Returns false if a step could not be completed;
   all are then those of the last one that was, and instance->failure tells why. */
bool integrate(Instance *instance, double end);

/* The relative tolerance: solver_tolerance if given, else that of fmi2SetupExperiment if given, else 1e-6. */
double solver_tolerance(const State *state);

#endif
