/* What is left of a Problem when bilateral, sliding and given rows are eliminated. */
#ifndef LAWS_H
#define LAWS_H

#include <stdbool.h>

#include "mechanism.h"

enum { ACTIVE = SIZE_ACTIVE };

/* w = offset + matrix x in units in which rows have diagonal entries of the order of 1; matrix is symmetric if there is
   no sliding row. */
typedef struct {
    int size;
    double matrix[ACTIVE * ACTIVE]; /* size entries a row */
    double offset[ACTIVE];
    int width[ACTIVE];    /* 0: unilateral; rows of friction: 1, or 2 for the first and -1 for the second of a cone */
    int normal[ACTIVE];   /* of a row of friction: the row whose x times limit bounds it; -1: limit bounds it */
    double limit[ACTIVE];
} Laws;

/* A choice of one equation a row: w = 0, or x = slope x[normal] + value. */
typedef struct {
    bool held[ACTIVE];
    double slope[ACTIVE];
    double value[ACTIVE];
} Choice;

/* w[size] for x[size]. */
void laws_evaluate(const Laws *laws, const double x[], double w[]);

/* The x[size] of least norm that satisfies the equations chosen. */
void laws_solve_choice(const Laws *laws, const Choice *choice, double x[]);

/* Do x[size] and the w that follow obey all laws, to rounding? */
bool laws_obeyed(const Laws *laws, const double x[]);

/* Solves the equations chosen; returns whether x[size] obeys all laws. */
bool laws_try(const Laws *laws, const Choice *choice, double x[]);

/* The greatest magnitude of x[k] of a row of friction. */
double laws_limit(const Laws *laws, const double x[], int k);

/* Is w of this row 0, to rounding? */
bool laws_at_rest(const Laws *laws, const double x[], int k);

/* Solves laws without contacts in space; x[size]. False: no solution. */
bool polyhedral_solve(const Laws *laws, double x[]);

/* Solves a problem in which pyramids with four sides stand for round cones; x[size]. */
bool polyhedral_approximate(const Laws *laws, double x[]);

/* Solves any laws, round cones too; x[size]. False: no solution was found. */
bool cones_solve(const Laws *laws, double x[]);

#endif
