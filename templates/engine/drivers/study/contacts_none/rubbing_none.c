/* Nothing slides. */
#include "rubbing.h"

void rubbing_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                     const double unknowns[], const Seed *seed, const double answer[], double change[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)inputs;
    (void)unknowns;
    (void)seed;
    (void)answer;
    (void)change;
}
