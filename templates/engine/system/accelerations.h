/* The accelerations qdd[n], and with constraints the multipliers behind them, at any time and states. */
#ifndef ACCELERATIONS_H
#define ACCELERATIONS_H

#include "instance.h"

/* unknowns[n + m] = qdd and the multipliers at the given time (s), states[2n] and inputs: by the generated formula, and
   where it does not hold by factorising (system.h). Touches no cache. Returns false, with instance->failure set, where
   there are none or where they are not finite.

   Where the policy says stabilise, another solver lets the constraints drift; their accelerations then are aimed at

       d2phi/dt2 = -2 s dphi/dt - s^2 phi,   s = STABILISATION,

   which brings phi back. Where the instance's solver projects, s is 0. Ascher, Chin, Reich, Stabilization of DAEs and
   invariant manifolds, Numerische Mathematik 67, 1994. */
bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[], double unknowns[]);

/* Adds to the tangent change[] of the residuals, [n + m + m + h], what stabilising adds to the accelerations of the
   constraints. */
void accelerations_stabilise(const Instance *instance, double change[]);

/* Makes the rates of the multipliers along the seed, behind those of the accelerations in unknowns[n + m], the rates of
   the multipliers of least norm. The cache holds the present accelerations and the factorised system. */
void multipliers_spread_rates(const Instance *instance, const Seed *seed, double unknowns[]);

#endif
