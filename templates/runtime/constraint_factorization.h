/* G M^-1 G^T multiplier = b for the Jacobian G of constraints: symmetric, positive semidefinite. */
#ifndef CONSTRAINT_FACTORIZATION_H
#define CONSTRAINT_FACTORIZATION_H

#include <stdbool.h>
#include <stdint.h>

#include "mechanism.h"

/* D G M^-1 G^T D = P^T L L^T P: D = diag(scale) makes all rows of D G of unit length in the metric M^-1, P is the
   permutation order. With redundant constraints L has fewer columns, rank, than rows. All row-major. */
typedef struct {
    double jacobian[N_CONSTRAINTS * N_COORDINATES]; /* G */
    double response[N_CONSTRAINTS * N_COORDINATES]; /* row k: M^-1 g_k, how the accelerations answer multiplier k */
    double scale[N_CONSTRAINTS];
    double factor[N_CONSTRAINTS * N_CONSTRAINTS]; /* L */
    int order[N_CONSTRAINTS];
    int rows; /* the first ones count, the others are left out */
    int rank; /* the first ones in the order are independent */
    double held[N_CONSTRAINTS]; /* of each row: 0 if it speaks for itself, up to 1 if it is about to be lost */
    bool holding; /* some row is held */
} ConstraintFactorization;

/* Which rows were found to be independent of each other, and are to be taken again, so that the accelerations remain
   smooth functions of the states. */
typedef struct {
    int64_t order[N_CONSTRAINTS];
    int64_t rank;
    double distance[N_CONSTRAINTS]; /* of each, at the start, from the span of those before it in the order, in the
                                       metric M^-1; 0: it is never held */
} IndependentRows;

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

/* From any multipliers to those of the same forces G^T multipliers that are of least norm in units of the scaled rows:
   scale^2 G w for some w. */
void constraints_spread(const ConstraintFactorization *factorization, double multipliers[]);

/* a[n] += M^-1 G^T multipliers. */
void constraints_respond(const ConstraintFactorization *factorization, const double multipliers[], double a[]);

#endif
