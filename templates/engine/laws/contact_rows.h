/* Rows of a Delassus operator and their laws: w = free + delassus lambda, where lambda are forces (impulses) and w
   accelerations (velocities) along the rows. Glocker, Set-Valued Force Laws, 2001. */
#ifndef CONTACT_ROWS_H
#define CONTACT_ROWS_H

#include <stdbool.h>

#include "arena.h"

typedef enum {
    ROW_FREE,       /* lambda = 0 */
    ROW_BILATERAL,  /* w = 0 */
    ROW_UNILATERAL, /* lambda >= value, w >= 0, one of them equal */
    ROW_TANGENTIAL, /* Coulomb's law at rest: w = 0 and |lambda| <= holding N, or lambda = -friction N w / |w| */
    ROW_SLIDING,    /* lambda = -friction N value */
    ROW_BOUNDED,    /* dry friction at rest: w = 0 and |lambda| <= holding, or lambda = -friction w / |w| */
    ROW_GIVEN       /* lambda = value */
} RowLaw;

/* N >= 0 is lambda of the row `normal`, which is unilateral, given or free. One or two consecutive tangential rows with
   the same normal make up a contact; of two, w and lambda are the vectors of both: the friction cone is round. */
typedef struct {
    RowLaw law;
    int normal;
    double friction; /* >= 0 */
    double holding;  /* >= friction */
    double value;    /* sliding: the component of the unit vector of the slip velocity; unilateral: >= 0, as a rule 0 */
    bool holds;      /* w = 0 at present: of several solutions the one in which just these rows hold is taken first */
    bool slid;       /* comes to hold only now: where not all can, it goes on to slip before those that hold already */
} Row;

typedef struct {
    Arena *arena; /* for the work of solving it */
    int rows;
    const double *delassus; /* [rows * rows], row-major, symmetric, positive semidefinite; rows may be redundant */
    const double *free;     /* [rows] */
    const Row *row;         /* [rows] */
    bool *determined;       /* [rows], set by the solution, or NULL: the bilateral rows alone determine the motion along
                               this row of friction, so that no force there has a lever */
} Problem;

#endif
