/* Solves the laws between many rows of which each acts on few others, as a time step of Moreau and Jean asks for
   them. What is solved costs as much as a step of elimination, which grows with the number of contacts times the square
   of how many lie between neighbours in the best order. */
#ifndef COMPLEMENTARITY_LARGE_H
#define COMPLEMENTARITY_LARGE_H

#include "sparse_rows.h"

/* Solves for lambda[rows] and, unless it is NULL, w[rows]. Newton's method starts from the lambda given: that of the
   step before, or zeros. If a row begins to slip in its solution, one in which the island rests comes first. Where
   neither is found, most_rounds rounds follow at most: each takes twice as many accelerated block Gauss-Seidel sweeps
   as the round before, and Newton's method starts again from where they lead. In islands of few rows each row may at
   last give way by up to a hundredth of what its own force moves; *problem->yielding is then set. False: no solution
   was found to rounding. lambda is then where the sweeps have led, which obeys the limits of all laws, and the
   equations w = free + delassus lambda may be left unsolved. */
bool complementarity_large(const SparseProblem *problem, int most_rounds, double lambda[], double w[]);

#endif
