/* The laws of a few rows that act on each other: most steps of most mechanisms have no others. */
#ifndef FEW_ROWS_H
#define FEW_ROWS_H

#include "sparse_rows.h"

enum { MOST_FEW_ROWS = 16 };

typedef enum {
    STATE_OPEN,   /* x = 0 */
    STATE_HELD,   /* w = 0 */
    STATE_SLIDING /* x = limit u, the limit follows the normal force */
} FewState;

/* w = offset + matrix x, in units in which diagonal entries are 1. */
struct FewRows {
    bool known;                   /* the operator and the kinds of laws are those of the next problem, too */
    bool factored;                /* the factors are those of the present states */
    int size;
    RowLaw law[MOST_FEW_ROWS];
    int contacts;                 /* rows that are unilateral */
    bool coulomb, round, dry;     /* are there rows of Coulomb's law, of round cones, of dry friction? */
    bool linear;                  /* are all rows bilateral? */
    double scale[MOST_FEW_ROWS];  /* of the row: lambda = scale x */
    double matrix[MOST_FEW_ROWS][MOST_FEW_ROWS];
    double offset[MOST_FEW_ROWS];
    double usual;                 /* the greatest entry of the offset */
    int width[MOST_FEW_ROWS];     /* as in laws.h, as the next ones */
    int normal[MOST_FEW_ROWS];
    double slope[MOST_FEW_ROWS];
    double base[MOST_FEW_ROWS];
    double rate[MOST_FEW_ROWS];   /* the proximal step */
    bool holds[MOST_FEW_ROWS];
    double x[MOST_FEW_ROWS], w[MOST_FEW_ROWS];
    FewState state[MOST_FEW_ROWS];
    bool given;                   /* are the states of contacts given? */
    int redundant;                /* how many rows that are held are redundant */
    int left_out;                 /* the one that the factors leave out, or -1 */
    double without[MOST_FEW_ROWS]; /* if one is: forces without any motion */
    bool unsure;                  /* shares of redundant rows were not tried that may rest */
    double along[MOST_FEW_ROWS];  /* u of a row that slides */
    double length[MOST_FEW_ROWS]; /* of its trial x - rate w */
    double right[MOST_FEW_ROWS];
    double damping;               /* of rows that are held: 0 as long as none is redundant */
    double factors[MOST_FEW_ROWS][MOST_FEW_ROWS];
};

/* Solves for lambda of these rows, those of a contact one after the other, from the lambda given. Goes on from there if
   nothing begins to slip, or redundant rows slide on; else it rests if there is any way to rest. False, and nothing is
   changed: there are too many rows, or this leads to no solution. If few->known, these rows have the operator that they
   had at the last call with this memory; its factors serve again where the equations are the same. */
bool few_rows(const SparseProblem *problem, int count, const int rows[], FewRows *few, double lambda[]);

#endif
