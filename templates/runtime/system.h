/* The linear system behind the accelerations, factorised at a point:

       M qdd = right,   or with constraints   [M  -G^T] [qdd       ]   [right]
                                              [G    0 ] [multiplier] = [below]

   M is factorised by generated code or, where the pivots of that are not sound, densely. With constraints M may be
   singular as long as the whole system is not: then M + G^T W G takes its place, with W = diag(weight). */
#ifndef SYSTEM_H
#define SYSTEM_H

#include "instance.h"

/* Are these pivots[n] of the generated code clearly positive? */
bool pivots_sound(Instance *instance, const double pivots[]);

/* M written out and factorised with pivoting where it must be; leaves the forcing in scratch. With mend, a singular M
   is replaced as said above. Returns false, with instance->failure, if the system determines no accelerations. */
bool system_factorize_densely(Instance *instance, double time, const double states[], const double inputs[],
                              System *system);

/* Factorises at a point, with the first rows of the constraints, damped as constraints_factorize says. Returns false
   likewise. */
bool system_factorize(Instance *instance, double time, const double states[], const double inputs[], int rows,
                      double damping, System *system);

/* unknowns = qdd[n] and multipliers[rows] behind it, for right[n] and below[rows]. What a held row says of qdd is taken
   from usual[n]; NULL: it makes no difference to qdd. */
void system_solve(const System *system, const double right[], const double *below, const double *usual,
                  double unknowns[]);

/* Where a solver step has failed for its error: puts a mass matrix that is about to become singular in the place of the
   error as the reason. */
void system_explain_failure(Instance *instance);

/* In model exchange the integrator is the importer's, and says nothing: tells, with instance->failure, whether the mass
   matrix is about to become singular and the accelerations[n] grow so that no integrator will go on for long. */
bool system_runs_into_singularity(Instance *instance, const double accelerations[]);

/* A fixed step has no error estimate that would grow where M becomes singular: tells, with instance->failure, whether the
   last one, of this length (s), has an end near such a place and changes velocities otherwise than the accelerations at
   both its ends say. */
bool system_leaps_over_singularity(Instance *instance, double length);

/* Sets instance->failure to this kind at this time, flagging coordinates[n]; returns false. */
bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]);

#endif
