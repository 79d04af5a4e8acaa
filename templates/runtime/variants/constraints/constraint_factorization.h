/* G M^-1 G^T multiplier = b for the Jacobian G of constraints: symmetric, positive semidefinite. */
#ifndef CONSTRAINT_FACTORIZATION_H
#define CONSTRAINT_FACTORIZATION_H

#include "constraint_records.h"

/* Fills the rest from jacobian and response. Of the known rows, if they are not NULL, all are taken that still are
   independent, and others only where they clearly are. With damping > 0 that times the identity is added to the scaled
   matrix: the solutions are then damped as in the method of Levenberg and Marquardt. By Cholesky's method with diagonal
   pivoting: Golub, Van Loan, Matrix Computations, 4th edition, section 4.2. */
void constraints_factorize(ConstraintFactorization *result, int rows, const IndependentRows *known, double damping);

/* The distance of the row at place k of the order from the span of those before it, in the metric M^-1. */
double constraints_distance(const ConstraintFactorization *factorization, int k);

/* The multipliers[rows] that solve for b[rows]; those of redundant rows are 0. Where a row is held, they do so for
   usual[rows] in its stead as far as it adds to the rows before it; NULL is 0. */
void constraints_solve(const ConstraintFactorization *factorization, const double b[], const double usual[],
                       double multipliers[]);

/* From such a solution to the one of least norm in units of the scaled rows. */
void constraints_spread(const ConstraintFactorization *factorization, double multipliers[]);

/* a[n] += M^-1 G^T multipliers. */
void constraints_respond(const ConstraintFactorization *factorization, const double multipliers[], double a[]);

#endif
