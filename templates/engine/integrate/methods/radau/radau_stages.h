/* The stages of a step of Radau IIA, see radau.c. Behind the accelerations stand the derivatives of further states: r =
   N_RATES. */
#ifndef RADAU_STAGES_H
#define RADAU_STAGES_H

#include "solver.h"

/* Solves for the accelerations[STAGES * r] at the stages, until their rest is small against this tolerance. Returns
   false, with instance->failure, if that fails. */
bool radau_solve(Instance *instance, Step step, double tolerance, double accelerations[]);

/* states[N_STATES] at stage i, 0 to STAGES - 1, of a step of length h (s) from x[N_STATES] for the
   accelerations[STAGES * r]. */
void radau_stage(const double x[], double h, int i, const double accelerations[], double states[]);

/* The time (s) of stage i. */
double radau_stage_time(const Instance *instance, Step step, int i);

/* The tolerance that errors of steps are measured with, for that asked for. */
double radau_inner_tolerance(double tolerance);

/* errors[2][N_STATES] of a step of length h (s) from x[N_STATES], whose accelerations[STAGES * r] are given, by the
   derivatives at its start; or those of what has x, derivatives and accelerations as its own derivatives. */
void radau_errors(const Instance *instance, double h, const double x[], const double derivatives[],
                  const double accelerations[], double errors[][N_STATES]);

/* Overwrites x[N_STATES] by (I - g J)^-1 x, with g = h MODES.real and the Jacobian J of the equations of first order
   that radau_solve has used: the error estimate of stiff components is made small by it, Hairer, Wanner, Solving
   Ordinary Differential Equations II, 2nd edition, section IV.8. */
void radau_filter(const Instance *instance, double h, double x[]);

/* accelerations[r] at the part x of the last step that was solved, of their polynomial; 0 if there was none. */
void radau_polynomial(const SolverMemory *memory, double x, double accelerations[]);

#endif
