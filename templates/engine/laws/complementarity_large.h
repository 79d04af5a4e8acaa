/* Solves the laws between many rows of which each acts on few others, as a time step of Moreau and Jean asks for
   them. What is solved costs as much as a step of elimination, which grows with the number of contacts times the square
   of how many lie between neighbours in the best order. */
#ifndef COMPLEMENTARITY_LARGE_H
#define COMPLEMENTARITY_LARGE_H

#include "sparse_rows.h"

/* Solves for lambda[rows] and, unless it is NULL, w[rows], from the lambda given: that of the step before, or zeros.
   Each island goes on from there if nothing begins to slip; else it rests if there is any way to rest. Where this leads
   to no solution, rounds of accelerated block Gauss-Seidel sweeps follow, each with twice as many as the one before, of
   which Newton's method starts again; so many rounds are the most. At last rows may give way by up to a hundredth of
   what their own force moves, and *problem->yielding is set. False: no solution was found to rounding; lambda is then
   what sweeps have led to, which obeys the limits of all laws, whatever is left of the equations. */
bool complementarity_large(const SparseProblem *problem, int most_rounds, double lambda[], double w[]);

#endif
