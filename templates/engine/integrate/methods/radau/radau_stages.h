/* The stages of a step of Radau IIA, see radau.c. Behind the accelerations stand the derivatives of further states: r =
   N_RATES. */
#ifndef RADAU_STAGES_H
#define RADAU_STAGES_H

#include "solver.h"

/* Solves for the accelerations[STAGES * r] at the stages, until their rest is small against this tolerance. Returns
   false, with instance->failure, if that fails. */
bool radau_solve(Instance *instance, Step step, double tolerance, double accelerations[]);

/* states[N_STATES] at stage i, 0 to STAGES - 1, of a step of length h (s) for the accelerations[STAGES * r]. */
void radau_stage(const Instance *instance, double h, int i, const double accelerations[], double states[]);

/* Overwrites x[N_STATES] by (I - g J)^-1 x, with g = h MODES.real and the Jacobian J of the equations of first order
   that radau_solve has used: the error estimate of stiff components is made small by it, Hairer, Wanner, Solving
   Ordinary Differential Equations II, 2nd edition, section IV.8. */
void radau_filter(const Instance *instance, double h, double x[]);

/* accelerations[r] at the part x of the last step that was solved, of their polynomial; 0 if there was none. */
void radau_polynomial(const SolverMemory *memory, double x, double accelerations[]);

#endif
