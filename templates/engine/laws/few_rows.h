/* The laws of a few rows that act on each other, on the stack: most steps of most mechanisms have no others. */
#ifndef FEW_ROWS_H
#define FEW_ROWS_H

#include "sparse_rows.h"

/* Solves for lambda of these rows, those of a contact one after the other, from the lambda given. Goes on from there if
   nothing begins to slip; else it rests if there is any way to rest. False, and nothing is changed: there are too many
   rows, or this leads to no solution. */
bool few_rows(const SparseProblem *problem, int count, const int rows[], double lambda[]);

#endif
