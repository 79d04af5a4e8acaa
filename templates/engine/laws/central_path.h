/* Convex programs over cones, and Coulomb's law as a small change of them. */
#ifndef CENTRAL_PATH_H
#define CENTRAL_PATH_H

#include <stdbool.h>

#include "sparse.h"

/* Of all y[size] with s = map y + shift in the cones s_0 >= |(s_1, s_2)|: the one of least
   1/2 y' (matrix + weight) y + offset' y. Each cone has three rows; those of a half line are 0 but for the first.
   With slip = 1 the first row of a cone feels z_0 - |(z_1, z_2)| of the multipliers z: where it is a normal force that
   bounds friction, normals then do not open because a contact slips. This correction by de Saxce turns the law of
   the program into that of Coulomb: Acary, Cadoux, Lemarechal, Malick, A formulation of the linear discrete Coulomb
   friction problem via convex optimization, ZAMM 2011. */
typedef struct {
    Arena *arena;
    int size;
    int cones;
    Sparse matrix;    /* [size * size]; positive semidefinite, but for rows that slide */
    double *offset;   /* [size] */
    Sparse map;       /* [3 * cones * size] */
    double *shift;    /* [3 * cones] */
    double *forces;   /* NULL, or room for the multipliers z, which are 0 but at the limits of the cones [3 * cones] */
    const int *first; /* NULL, or the first entry that y[i] meets in the matrix or in a cone [size] */
} ConeProgram;

typedef struct {
    double slip;     /* 0: the convex program; 1: Coulomb's law */
    double weight;   /* of the norm of y, which selects one of several solutions */
    double centring; /* least part of the way that leads to the centre of the cones: 0, or more where the way is bent */
} PathOptions;

/* Where the central path of the program ends, or the place nearest to its end: y[size], to some 1e-12 of its greatest
   entry. False, with arena->refused: there is no memory. */
bool central_path(const ConeProgram *program, PathOptions options, double y[]);

#endif
