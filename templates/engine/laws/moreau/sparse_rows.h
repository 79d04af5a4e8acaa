/* Many contacts of which each touches few others: a sparse Delassus operator and the order of its elimination. */
#ifndef SPARSE_ROWS_H
#define SPARSE_ROWS_H

#include "contact_rows.h"
#include "sparse.h"

typedef struct FewRows FewRows; /* few_rows.h */

/* The rows of a contact follow each other: that of its normal, then one or two tangential ones. */
typedef struct {
    Arena *arena;
    Sparse delassus; /* symmetric, positive semidefinite; the diagonal entries are always there */
    const double *free; /* [rows] */
    const Row *row;     /* [rows]: bilateral, unilateral, tangential and bounded; holding and values are not used */
    bool *yielding;     /* set where the laws have a solution only for rows that give way */
    FewRows *few;       /* memory for the next problem with this operator, or NULL */
} SparseProblem;

/* The rows in the order of elimination, where those of a contact follow each other as before. */
typedef struct {
    int *row;     /* place -> row */
    int *place;   /* row -> place */
    int *first;   /* place -> the first place of its envelope */
    int *island;  /* the first places of the islands, whose rows neither act on each other nor share a contact */
    int islands;  /* island[islands] = rows */
} RowOrder;

/* The order of Cuthill and McKee, Reducing the bandwidth of sparse symmetric matrices, 1969, reversed: George, Liu,
   Computer Solution of Large Sparse Positive Definite Systems, 1981, chapter 4. The arrays are of the arena. False:
   there is no memory. */
bool rows_order(const SparseProblem *problem, RowOrder *order);

#endif
