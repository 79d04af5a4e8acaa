/* The memory of time stepping. Rows are numbered as in row_tables.h. */
#ifndef SOLVER_MEMORY_H
#define SOLVER_MEMORY_H

#include <stdbool.h>

#include "changes.h"
#include "few_rows.h"
#include "mechanism.h"
#include "row_tables.h"

/* Bytes of work that the laws of a step ask for at most: an envelope without any entry outside of it, the operator and
   a copy of it, and vectors. Where there is no heap, they lie in the first block of the arena. */
#define SOLVER_WORK                                                                                                   \
    (REAL_TIME ? sizeof(double) * ((size_t)N_CONSTRAINTS * (N_CONSTRAINTS + 100) + 4 * (size_t)N_MEETINGS) + 4096 : 0)

typedef struct {
    double forces[N_CONSTRAINTS]; /* impulses of the last step by its length: where the next solution begins */
} SolverMemory;

/* The forces are a guess that serves as well after a change of the inputs. */
static inline void solver_forget(SolverMemory *memory, Change change) {
    (void)memory;
    (void)change;
}

/* The number of rows whose response M^-1 G^T is kept. With more than 24 the sum of their responses takes longer than
   solving with M anew. */
enum { MOST_RESPONSES = N_BLOCKS > 1 ? 1 : N_CONSTRAINTS < 24 ? N_CONSTRAINTS : 24 };

/* The rows at some states. */
typedef struct {
    double entries[SIZE_ENTRIES];   /* of G */
    double positions[N_CONSTRAINTS]; /* of rows that have one */
    double velocities[N_CONSTRAINTS];
    double sizes[N_CONSTRAINTS];     /* how much a change of the coordinates by their nominal values moves a row */
} SteppedRows;

/* The Delassus operator of some rows, row by row: what an impulse of the one changes along those that it meets. */
typedef struct {
    int count;
    int rows[N_CONSTRAINTS];      /* number of the row among them -> row, ascending */
    int index[N_CONSTRAINTS];     /* row -> its number, -1: it is none of them */
    int start[N_CONSTRAINTS + 1]; /* the first entry of each row, and their end */
    int column[N_MEETINGS];       /* the number of the row that is met, ascending */
    double value[N_MEETINGS];
} RowsMet;

/* A complementarity problem of chosen rows, and its solution. */
typedef struct {
    RowsMet met;
    double free[N_CONSTRAINTS];
    Row row[N_CONSTRAINTS];
    double lambda[N_CONSTRAINTS];
    double w[N_CONSTRAINTS];
    bool yielding; /* the solution is one of rows that give way */
    bool known;    /* met is of the present operator */
    FewRows few;   /* of these rows */
} ChosenRows;

typedef struct {
    SteppedRows at;                          /* in the middle of the step */
    SteppedRows end;                         /* at its end: positions, and all of permanent constraints */
    double still[SIZE_STILL];                /* what does not move with velocities, there */
    double accelerations[N_COORDINATES];     /* without forces of rows, there */
    RowsMet met;                             /* the active rows */
    double responses[MOST_RESPONSES][N_COORDINATES]; /* M^-1 G^T of the first ones, where M has one block */
    double pace;                             /* the greatest velocity in nominal values, at least 1/s */
    bool nominal;                            /* a metric of nominal values takes the place of M */
    bool closing;                            /* contacts that stay are put to a gap of 0 at the end */
    bool unsolved;                           /* the laws were not met: too little work, or no solution for rigid rows */
    bool active[N_CONSTRAINTS];              /* obey their laws in this step: contacts if they touch */
    double restitution[SIZE_UNILATERALS];    /* of contacts that collide in this step; 0 of others */
    double friction[SIZE_UNILATERALS];       /* what friction bears of the normal force */
    double dry[N_FRICTIONS + 1];             /* the forces of dry frictions */
    double impulses[N_CONSTRAINTS];
    double reversals[N_CONSTRAINTS];         /* impulses of permanent constraints that turn round what these move */
    double after[N_CONSTRAINTS];             /* velocities along the rows at the end of the step */
    ChosenRows chosen;
} SolverScratch;

#endif
