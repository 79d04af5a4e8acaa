/* Derivatives of the forces of sliding J^T z, which are J^T dz + dJ^T z. The second term is what a z of its own makes
   of the residual of the equations, M qdd - forcing - J^T z - G^T multiplier. */
#ifndef RUBBING_H
#define RUBBING_H

#include "instance.h"

/* alone[n + m]: of the unknowns the forces of what slides, and 0 elsewhere. */
void rubbing_alone(const Instance *instance, const double unknowns[], double alone[]);

/* Adds to change[n] that of the forces of contacts_rub along a seed at the point, where the unknowns[n + m] have this
   answer[n + m]. */
void rubbing_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                     const double unknowns[], const Seed *seed, const double answer[], double change[]);

#endif
