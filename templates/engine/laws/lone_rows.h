/* The laws of a row that acts on no other one, and of a contact in the plane that does not: in closed form. */
#ifndef LONE_ROWS_H
#define LONE_ROWS_H

#include "sparse_rows.h"

/* Solves for lambda of these rows, one of any law, or a normal and its tangential one. False, and nothing is changed:
   they are others, they are redundant, or friction is so great that there may be several solutions. */
bool lone_rows(const SparseProblem *problem, int count, const int rows[], double lambda[]);

#endif
