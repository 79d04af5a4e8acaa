/* The Jacobian of the accelerations and of the derivatives of further states, for implicit solvers. */
#ifndef JACOBIAN_H
#define JACOBIAN_H

#include "instance.h"

/* d(qdd, dz/dt)/d(q, qd, z) at any time (s) and states in a communication step: jacobian[N_STATES][N_RATES], a row for
   each state.
   Touches no cache. Returns false, with instance->failure set, where there are no accelerations. */
bool equations_jacobian(Instance *instance, double time, const double states[], double jacobian[]);

#endif
