/* G M^-1 G^T multiplier = b for the Jacobian G of constraints: symmetric, positive semidefinite. */
#ifndef CONSTRAINT_FACTORIZATION_H
#define CONSTRAINT_FACTORIZATION_H

#include "arena.h"
#include "constraint_records.h"

/* Completes a factorisation of which jacobian and response are given. If known is not NULL, its rows are taken where
   they are still independent, and other rows only where they are clearly independent. With damping > 0, damping times
   the identity is added to the scaled matrix: solutions are then damped as in the method of Levenberg and Marquardt.
   Cholesky's method with diagonal pivoting: Golub, Van Loan, Matrix Computations, 4th edition, section 4.2. */
void constraints_factorize(Arena *arena, ConstraintFactorization *result, int rows, const IndependentRows *known,
                           double damping);

/* By how much what row k restricts changes where one coordinate changes by its nominal value, at most. */
double constraints_slope(const double jacobian[], int k);

/* The distance of the row at place k of the order from the span of those before it, in the metric M^-1. */
double constraints_distance(const ConstraintFactorization *factorization, int k);

/* The square of the distance at which a row with this `usual` one gives place to a redundant one that is clearly
   independent: at 18 % of it, in decades halfway to clear independence. Errors of an importer's states grow with the
   inverse square of the distance: there 30 times, at 3 % a thousand times. */
double constraints_weakened(double usual);

/* The multipliers[rows] that solve for b[rows]; those of redundant rows are 0. A row that is held takes its part of the
   right side from usual[rows] instead of b, as far as it adds to the rows before it; NULL stands for zeros. */
void constraints_solve(Arena *arena, const ConstraintFactorization *factorization, const double b[],
                       const double usual[], double multipliers[]);

/* From any multipliers to those of the same forces G^T multipliers that are of least norm in units of the scaled rows:
   scale^2 G w for some w. Those of rows that restrict nothing stay as they are. */
void constraints_spread(Arena *arena, const ConstraintFactorization *factorization, double multipliers[]);

/* a[n] += M^-1 G^T multipliers. */
void constraints_respond(const ConstraintFactorization *factorization, const double multipliers[], double a[]);

#endif
