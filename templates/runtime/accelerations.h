/* The accelerations qdd[n], and with constraints the multipliers behind them, at any time and states. */
#ifndef ACCELERATIONS_H
#define ACCELERATIONS_H

#include "instance.h"

/* unknowns = qdd[n] and the multipliers[m] at the given time (s), states and inputs. Touches no cache. Returns false,
   with instance->failure set, where there are none or where they are not finite. */
bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[], double unknowns[]);

/* Multipliers of redundant constraints are not unique; shown is the solution of least norm: this makes it of any, given
   behind the accelerations, with the system factorised at the point. */
bool multipliers_unique(const Instance *instance);
void multipliers_spread(const System *system, double unknowns[]);

#if N_CONSTRAINTS > 0
/* In model exchange the importer's solver lets the constraints drift; their accelerations then are aimed at

       d2phi/dt2 = -2 s dphi/dt - s^2 phi,   s = STABILISATION,

   which brings phi back. Co-simulation projects instead. Ascher, Chin, Reich, Stabilization of DAEs and invariant
   manifolds, Numerische Mathematik 67, 1994. */
double stabilisation(const Instance *instance);
#endif

#endif
