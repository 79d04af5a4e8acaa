/* The transposed tangent of the constraints themselves. */
#ifndef ADJOINT_CONSTRAINTS_H
#define ADJOINT_CONSTRAINTS_H

#include "instance.h"

/* Adds to the sensitivity the derivatives of the weighted sum of positions[h] and velocities[m] of the constraints. */
void add_constraints_adjoint(const Instance *instance, const double positions[], const double velocities[],
                             Seed *sensitivity);

#endif
