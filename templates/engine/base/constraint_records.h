/* What is stored of the constraints' Jacobian G; constraint_factorization.h calculates with it. */
#ifndef CONSTRAINT_RECORDS_H
#define CONSTRAINT_RECORDS_H

#include <stdbool.h>
#include <stdint.h>

#include "mechanism.h"

/* D G M^-1 G^T D = P^T L L^T P: D = diag(scale) makes all rows of D G of unit length in the metric M^-1, P is the
   permutation order. With redundant constraints L has fewer columns, rank, than rows. All row-major. */
typedef struct {
    double jacobian[SIZE_CONSTRAINTS * N_COORDINATES];  /* G */
    double response[SIZE_CONSTRAINTS * N_COORDINATES];  /* row k: M^-1 g_k, how accelerations answer multiplier k */
    int begin[SIZE_CONSTRAINTS], end[SIZE_CONSTRAINTS]; /* row k of both is 0 outside of columns begin to end - 1 */
    double scale[SIZE_CONSTRAINTS];
    double factor[SIZE_CONSTRAINTS * SIZE_CONSTRAINTS]; /* L */
    int order[SIZE_CONSTRAINTS];
    int rows;                      /* the first ones count, the others are left out */
    int rank;                      /* the first ones in the order are independent */
    double held[SIZE_CONSTRAINTS]; /* of each row: 0 if it speaks for itself, up to 1 if it is about to be lost */
    bool holding;                  /* some row is held */
} ConstraintFactorization;

/* The columns from the first to the end of row k, but for zeros. With few columns all of them: loops whose bounds the
   compiler knows are faster. */
enum { MANY_COLUMNS = 17 };

static inline int row_begin(const ConstraintFactorization *f, int k) {
    return N_COORDINATES < MANY_COLUMNS ? 0 : f->begin[k];
}

static inline int row_end(const ConstraintFactorization *f, int k) {
    return N_COORDINATES < MANY_COLUMNS ? N_COORDINATES : f->end[k];
}

/* Which rows were found to be independent of each other. They are taken again, so that the accelerations remain smooth
   functions of the states. */
typedef struct {
    int64_t order[SIZE_CONSTRAINTS];
    int64_t rank;
    double distance[SIZE_CONSTRAINTS]; /* of each, at the start or, for an importer's solver, the greatest so far, from
                                          the span of those before it in the order, in the metric M^-1; 0: it is never
                                          held */
    double slope[SIZE_CONSTRAINTS];    /* of each, in the same way, see constraints_slope; 0: unknown */
} IndependentRows;

#endif
