/* The derivative of the states, as solvers ask for it. */
#ifndef DERIVATIVE_H
#define DERIVATIVE_H

#include "instance.h"

/* derivatives = [qd, qdd, dz/dt] at any time (s) and states in a communication step, with the inputs at that time.
   Returns false, with instance->failure, where there is none;
   the derivatives are not to be used then. Touches no cache: the solver does not depend on
   which variables were read in between. */
bool derivative_at(Instance *instance, double time, const double states[], double derivatives[]);

#endif
