/* G M^-1 G^T multiplier = b for the Jacobian G of constraints: symmetric, positive semidefinite. */
#ifndef CONSTRAINT_FACTORIZATION_H
#define CONSTRAINT_FACTORIZATION_H

#include "mechanism.h"

/* D G M^-1 G^T D = P^T L L^T P: D = diag(scale) makes all rows of D G of unit length in the metric M^-1, P is the
   permutation order. With redundant constraints L has fewer columns, rank, than rows; normal then is the Cholesky
   factor of L^T L. All row-major. */
typedef struct {
    double jacobian[N_CONSTRAINTS * N_COORDINATES]; /* G */
    double response[N_CONSTRAINTS * N_COORDINATES]; /* row k: M^-1 g_k, how the accelerations answer multiplier k */
    double scale[N_CONSTRAINTS];
    double factor[N_CONSTRAINTS * N_CONSTRAINTS]; /* L */
    double normal[N_CONSTRAINTS * N_CONSTRAINTS];
    int order[N_CONSTRAINTS];
    int rows; /* the first ones count, the others are left out */
    int rank;
} ConstraintFactorization;

/* Fills the rest from jacobian and response. With damping > 0 that times the identity is added to the scaled matrix:
   the solutions are then damped as in the method of Levenberg and Marquardt. */
void constraints_factorize(ConstraintFactorization *result, int rows, double damping);

/* The multipliers[rows] that solve for b[rows]; of all solutions with redundant constraints, the one of least norm in
   units of the scaled rows. A b that contradicts itself is met in the rows chosen by the pivoting only. */
void constraints_solve(const ConstraintFactorization *factorization, const double b[], double multipliers[]);

/* a[n] += M^-1 G^T multipliers. */
void constraints_respond(const ConstraintFactorization *factorization, const double multipliers[], double a[]);

#endif
