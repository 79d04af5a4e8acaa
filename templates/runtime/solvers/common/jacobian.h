/* The Jacobian of the accelerations, for implicit solvers. */
#ifndef JACOBIAN_H
#define JACOBIAN_H

#include "instance.h"

/* d(qdd)/d(q, qd) at any time (s) and states[2n] in a communication step: jacobian[2n][n], a row for each state.
   Touches no cache. Returns false, with instance->failure set, where there are no accelerations. */
bool equations_jacobian(Instance *instance, double time, const double states[], double jacobian[]);

#endif
