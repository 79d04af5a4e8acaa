/* The laws of hundreds of contacts of which each touches few others, as a time step of Moreau and Jean asks for them.
   A sweep costs as much as the operator has entries; a step of elimination grows with the number of contacts times the
   square of how many lie between neighbours in the best order. */
#ifndef COMPLEMENTARITY_LARGE_H
#define COMPLEMENTARITY_LARGE_H

#include <stdbool.h>

#include "sparse_rows.h"

/* Memory of the caller; nothing in it has to be kept. */
typedef struct {
    int *integers;   /* [7 * rows + 1] */
    double *numbers; /* [4 * rows + 2 * capacity] */
    int capacity;    /* of the envelope of the elimination; rows * (rows + 1) / 2 serves always, often far less */
    int most_sweeps; /* of one round; each round has twice as many as the one before */
} LargeWork;

/* Solves for lambda[rows] and w[rows], from the lambda given: that of the step before, or zeros. Accelerated block
   Gauss-Seidel sweeps find what opens, sticks and slides, a generalised Newton method with sparse elimination goes on
   to rounding (Alart, Curnier, A mixed formulation for frictional contact problems prone to Newton like solution
   methods, Comput. Methods Appl. Mech. Eng. 1991; with the damping of Yamashita, Fukushima, On the rate of convergence
   of the Levenberg-Marquardt method, Computing 15, 2001). residual: what is left, relative to the greatest free motion,
   each in units of its row. False: more than tolerance is left; lambda is then the best that was found. */
bool complementarity_large(const SparseProblem *problem, double tolerance, const LargeWork *work, double lambda[],
                           double w[], double *residual);

/* A last sweep from the best that was found: lambda obeys the limits of all laws, whatever is left of the equations. */
void complementarity_project(const SparseProblem *problem, const LargeWork *work, double lambda[], double w[]);

#endif
