/* A Problem falls into islands: rows of different islands neither act on each other nor share a normal force. Each is
   a problem of its own, and what they cost grows with their number, not with its cube. */
#ifndef ISLANDS_H
#define ISLANDS_H

#include "contact_rows.h"

/* Is this the second tangential row of its contact? The rows before it of the same contact decide. */
bool is_second(const Row row[], int k);

/* scale[rows], with which the diagonal entries of the rows are 1; that of the two rows of a cone is the same. The entry
   of row k is diagonal[k * apart]. */
void find_scales(int rows, const Row row[], const double diagonal[], int apart, double scale[]);

typedef struct {
    int count;
    int *island;   /* [rows]: row -> its island, -1 for a free row that is the normal of no other one */
    double *scale; /* [rows], of find_scales */
} Islands;

/* Finds the islands, with arrays of the arena. False: there is no memory for them. */
bool islands_find(const Problem *problem, Islands *islands);

#endif
