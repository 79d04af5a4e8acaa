/* The linear system behind the accelerations, factorised at a point:

       M qdd = right,   or with constraints   [M  -G^T] [qdd       ]   [right]
                                              [G    0 ] [multiplier] = [below]

   M is factorised by generated code or, where the pivots of that are not sound, densely. With constraints M may be
   singular as long as the whole system is not: then M + G^T W G takes its place, with W = diag(weight). */
#ifndef SYSTEM_H
#define SYSTEM_H

#include <stddef.h>

#include "instance.h"

/* Factorises at a point, with the first rows of the constraints, damped as constraints_factorize says. Returns false,
   with instance->failure, if the system determines no accelerations. */
bool system_factorize(Instance *instance, double time, const double states[], const double inputs[], int rows,
                      double damping, System *system);

/* unknowns = qdd[n] and multipliers[rows] behind it, for right[n] and below[rows]. What a held row says of qdd is taken
   from usual[n]; NULL: it makes no difference to qdd. */
void system_solve(const System *system, const double right[], const double *below, const double *usual,
                  double unknowns[]);

/* Are the multipliers at the present point the only ones? Those of redundant constraints are not. */
bool multipliers_unique(const Instance *instance);

/* Makes the multipliers behind the accelerations, in unknowns[n + m], the solution of least norm, which is what is
   shown; with the system factorised at the point. */
void multipliers_spread(const System *system, double unknowns[]);

/* unknowns = - K^-1 change, with a factorisation of the matrix K of the system; change[n + m] turns its sign. */
static inline void system_answer(const System *system, double change[], double unknowns[]) {
    for (int i = 0; i < N_UNKNOWNS; i++) {
        change[i] = -change[i];
    }
    system_solve(system, change, change + N_COORDINATES, NULL, unknowns);
}

#endif
