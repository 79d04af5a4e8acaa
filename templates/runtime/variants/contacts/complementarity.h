/* The laws of contacts and dry friction between the rows of a Delassus operator: w = free + delassus lambda, where lambda
   are forces (impulses) and w accelerations (velocities) along the rows. SIZE_ROWS of mechanism.h is the largest number
   of rows, SIZE_ACTIVE the largest number of unilateral, tangential and bounded rows together, both at least 1.
   Sources: Glocker, Set-Valued Force Laws, 2001; Pfeiffer, Glocker, Multibody Dynamics with Unilateral Contacts, 1996;
   Stewart, Trinkle, An implicit time-stepping scheme for rigid body dynamics with inelastic collisions and Coulomb
   friction, Int. J. Numer. Meth. Eng. 1996 (the complementarity problem whose solution Lemke's method finds). */
#ifndef COMPLEMENTARITY_H
#define COMPLEMENTARITY_H

#include <stdbool.h>

#include "mechanism.h"

typedef enum {
    ROW_FREE,       /* lambda = 0 */
    ROW_BILATERAL,  /* w = 0 */
    ROW_UNILATERAL, /* lambda >= 0, w >= 0, one of them 0 */
    ROW_TANGENTIAL, /* Coulomb's law at rest: w = 0 and |lambda| <= holding N, or lambda = -friction N w / |w| */
    ROW_SLIDING,    /* lambda = -friction N value */
    ROW_BOUNDED,    /* dry friction at rest: w = 0 and |lambda| <= holding, or lambda = -friction w / |w| */
    ROW_GIVEN       /* lambda = value */
} RowLaw;

/* N is lambda of the row `normal`, which is unilateral, given or free. One or two consecutive tangential rows with the
   same normal make up a contact; of two, w and lambda are the vectors of both: the friction cone is round. */
typedef struct {
    RowLaw law;
    int normal;
    double friction; /* >= 0 */
    double holding;  /* >= friction */
    double value;    /* sliding: the component of the unit vector of the slip velocity */
    bool holds;      /* w = 0 at present: of several solutions the one in which just these rows hold is taken first */
} Row;

typedef struct {
    int rows;
    const double *delassus; /* [rows * rows], row-major, symmetric, positive semidefinite; rows may be redundant */
    const double *free;     /* [rows] */
    const Row *row;         /* [rows] */
} Problem;

/* Solves for lambda[rows] and w[rows] to rounding. Where w has to be 0 it is exactly 0, but for bilateral rows that
   contradict each other. Where rows are redundant, bilateral rows get multipliers of least norm, in units of rows whose
   diagonal entry is 1, and so do unilateral and tangential rows if that obeys their laws. Equal problems give equal
   results, on ties the order of the rows decides.
   False: there is no solution (Painleve's paradox; never without sliding rows as long as free belongs to a motion), or
   none was found. */
bool complementarity_solve(const Problem *problem, double lambda[], double w[]);

#endif
