/* The laws of unilateral rows and of rows of friction: what is left of a Problem (contact_rows.h) when its bilateral,
   sliding and given rows are eliminated. */
#ifndef LAWS_H
#define LAWS_H

#include <stdbool.h>

#include "sparse.h"

/* w = offset + matrix x in units in which rows have diagonal entries of the order of 1; matrix is symmetric if there is
   no sliding row. */
typedef struct {
    Arena *arena;
    int size;
    Sparse matrix;    /* of two rows either each acts on the other or none does; [size * size] if small */
    const int *first; /* NULL, or the first row that row i, its cone and what its cone acts on have [size] */
    double *offset; /* [size], as the next ones */
    double *terms;  /* the sum of the absolute terms of the offset: its rounding error is a part of that */
    bool *determined; /* bilateral rows alone determine the motion along the row */
    double *curvature; /* a bound of the eigenvalues of the block of the matrix that a row or cone has */
    int *width;     /* 0: unilateral; friction: 1, or 2 for the first and -1 for the second row of a cone */
    int *normal;    /* rows of friction: base + slope x[normal] bounds x; -1: base does */
    double *slope;
    double *base;      /* HUGE_VAL for a row that has no limit: it holds */
} Laws;

/* A choice of one equation a row: w = 0, or x = slope x[normal] + value. */
typedef struct {
    bool *held; /* [size], as the next ones */
    double *slope;
    double *value;
} Choice;

/* Bytes of laws of `size` rows whose matrix has `entries` entries, for a reservation. */
size_t laws_bytes(size_t size, size_t entries);

/* Laws of the arena for this matrix, with undefined elements. */
Laws laws_take(Arena *arena, Sparse matrix);

/* A choice with zeros, of the arena. */
Choice choice_take(Arena *arena, int size);

/* Chooses that x of a row of friction is its limit, on this side. */
void choice_limit(const Laws *laws, int k, double side, Choice *choice);

/* w[size] for x[size]. */
void laws_evaluate(const Laws *laws, const double x[], double w[]);

/* The sum of the absolute terms of w[k]. */
double laws_terms(const Laws *laws, const double x[], int k);

/* Sets the curvature, which follows from matrix and width. */
void laws_curve(const Laws *laws);

/* Do x[size] and the w that follow obey all laws, to rounding? */
bool laws_obeyed(const Laws *laws, const double x[]);

/* Changes x[size] so that it satisfies the equations chosen, as rows that give way alike would: from zeros this gives
   the solution of least norm where no row slides. Returns whether x obeys all laws. */
bool laws_try(const Laws *laws, const Choice *choice, double x[]);

/* Is x of all rows that are held within its bounds, not only to the accuracy of a solution? A contact that pulls and
   one that sticks beyond its cone do not go on, by however little. */
bool laws_bounded(const Laws *laws, const Choice *choice, const double x[]);

/* Contacts that pull, by no more than `most`, bear nothing. */
void laws_clear_pulls(const Laws *laws, double most, double x[]);

/* The greatest magnitude of x[k] of a row of friction. */
double laws_limit(const Laws *laws, const double x[], int k);

/* Is w of this row 0, to rounding? */
bool laws_at_rest(const Laws *laws, const double x[], int k);

/* Does this row of friction, or the first one of its cone, slip? */
bool laws_slips(const Laws *laws, const double x[], int k);

#endif
