/* A mechanism whose states are coordinates and velocities alone. */
#include "further.h"

bool further_rates(Instance *instance, double time, const double states[], const double inputs[],
                   const double unknowns[], double rates[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)inputs;
    (void)unknowns;
    (void)rates;
    return true;
}

void further_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                     const double unknowns[], const Seed *seed, const double changed[], double changes[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)inputs;
    (void)unknowns;
    (void)seed;
    (void)changed;
    (void)changes;
}
