/* The mass matrix M at a point: factorised, judged, and named in failures. */
#ifndef MASS_MATRIX_H
#define MASS_MATRIX_H

#include "instance.h"

/* Are these pivots[n] of the generated code clearly positive? */
bool pivots_sound(Instance *instance, const double pivots[]);

/* Writes M out in scratch and factorises it, with pivoting where it must be; leaves the forcing in scratch. Unless the
   outcome is MASS_REGULAR, concerned[n] flags the coordinates. */
MassOutcome mass_evaluate(Instance *instance, double time, const double states[], const double inputs[],
                          System *system, bool concerned[]);

/* Returns whether the outcome is MASS_REGULAR; if not, sets instance->failure, flagging concerned[n]. */
bool mass_accept(Instance *instance, MassOutcome outcome, double time, const bool concerned[]);

/* a[n] = M^-1 b[n] */
void mass_divide(const System *system, const double b[], double a[]);

/* Is M singular at these states[2n], with the present inputs, but for this part? Flags the coordinates concerned[n].
   Never under constraints: there the whole system is to be regular, not M. */
bool mass_about_to_vanish(Instance *instance, const double states[], double part, bool concerned[]);

#endif
