/* Linear complementarity problems. */
#ifndef LEMKE_H
#define LEMKE_H

#include <stdbool.h>

#include "arena.h"

/* y = q + M z, y >= 0, z >= 0, for each k one of y[k] and z[k] is 0. The rows of M are of the order of 1. */
typedef struct {
    int size;
    double *matrix; /* [size * size]: M, row-major */
    double *offset; /* [size]: q */
} Lcp;

/* A solution z[size]; positive[k]: z[k] is one of the variables that y[k] = 0 determines. False if the method ends on a
   ray; for a copositive M there is then no solution as a rule, for others there may be one. Complementary pivoting with
   lexicographic choice, which never cycles: Lemke, Bimatrix equilibrium points and mathematical programming, Management
   Science 1965; Cottle, Pang, Stone, The Linear Complementarity Problem, 1992, section 4.4 and 4.9. */
bool lemke_solve(Arena *arena, const Lcp *problem, double z[], bool positive[]);

#endif
