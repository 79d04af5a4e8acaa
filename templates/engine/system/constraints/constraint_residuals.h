/* By how much states miss the constraints. */
#ifndef CONSTRAINT_RESIDUALS_H
#define CONSTRAINT_RESIDUALS_H

#include "instance.h"

/* The constraints at some states. */
typedef struct {
    double positions[N_HOLONOMIC + 1]; /* one more, because C has no array of length 0 */
    double velocities[N_CONSTRAINTS];
    double jacobian[N_CONSTRAINTS * N_COORDINATES];
    double units[N_CONSTRAINTS]; /* of the residuals: what a coordinate's nominal value changes them by */
} Values;

/* Positions (of the holonomic constraints) or velocities (of all). */
typedef enum { POSITIONS, VELOCITIES } Level;

/* The number of constraints of a level. */
int rows_of(Level level);

/* The constraints at states[2n]. */
void residuals_evaluate(const Instance *instance, double time, const double states[], const double inputs[],
                        Values *values);

/* The unit of residuals in nominal values: 1 for positions; for velocities the greatest velocity in nominal values
   (1/s), at least 1/s. An iteration keeps the unit of its beginning, because what it brings to rest is no measure. */
double residual_unit(Level level, const double states[]);

/* The greatest relative residual; infinite for one that is not finite. Rows that are held count less: relative to what
   is left of such a row rounding errors have no bound. held[m] may be NULL. */
double residual_size(const Values *values, Level level, double unit, const double held[]);

/* Has an iteration that goes on no further met the constraints, at states[2n], for which they are factorised? A row
   that is redundant is not corrected: at its distance from the others it leaves the velocities that these allow. A row
   near a singular position is held: an iteration takes away a share of its residual, so that rounding does not grow.
   What the last one leaves waits for a step that ends farther off. */
bool residuals_accepted(const Values *values, Level level, double unit, const ConstraintFactorization *constraints,
                        const double states[], bool last);

/* Sets instance->failure to constraints that are not met; returns false. */
bool report_constraints(Instance *instance, double time, const Values *values, Level level);

/* The damping of a correction of residuals of this relative size: with redundant constraints solutions are not
   isolated, and the convergence stays quadratic. Yamashita, Fukushima, On the rate of convergence of the
   Levenberg-Marquardt method, Computing 15, 2001. */
double damping_of(double size);

#endif
