/* The laws of a row, of a contact in the plane, and of two rows without friction, in closed form. */
#ifndef LONE_ROWS_H
#define LONE_ROWS_H

#include "sparse_rows.h"

/* Solves for lambda of these rows, on which no others act: one of any law, two that are unilateral or bilateral, or a
   normal and its tangential one. False, and nothing is changed: they are others, they are redundant, or friction is so
   great that there may be several solutions. */
bool lone_rows(const SparseProblem *problem, int count, const int rows[], double lambda[]);

#endif
