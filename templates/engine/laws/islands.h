/* A Problem falls into islands: rows of different islands neither act on each other nor share a normal force. Each is
   a problem of its own, and what they cost grows with their number, not with its cube. */
#ifndef ISLANDS_H
#define ISLANDS_H

#include "contact_rows.h"

typedef struct {
    int count;
    int *island; /* [rows]: row -> its island, -1 for a free row that is the normal of no other one */
} Islands;

/* One island as a problem, whose arrays belong to the arena; its rows keep their order. */
typedef struct {
    Problem problem;
    int *row; /* [problem.rows]: place -> row of the whole problem */
} Island;

/* Finds the islands, with arrays of the arena. False: there is no memory for them. */
bool islands_find(const Problem *problem, Islands *islands);

/* Takes an island out of the problem. False: there is no memory for it. */
bool island_take(const Problem *problem, const Islands *islands, int which, Island *island);

#endif
