<<<<<<< HEAD
/* The rows of contacts, stops, dry frictions and latches, whatever their modes.

   Rows stand in this order: the gaps of the N_UNILATERALS contacts and stops; their slips, those of contact i from
   SLIP_ROWS[i] up to SLIP_ROWS[i + 1]; dry frictions; latches, the holonomic ones first. Among the constraints row r
   has the place ROW_PLACES[r]. Slips and dry frictions are frictional rows: they may slide. */
#ifndef CONTACT_ROWS_H
#define CONTACT_ROWS_H

#include "instance.h"

enum {
    FIRST_SLIP = N_UNILATERALS,
    FIRST_FRICTION = N_UNILATERALS + N_SLIPS,
    FIRST_LATCH = FIRST_FRICTION + N_FRICTIONS,
    N_FRICTIONAL = N_SLIPS + N_FRICTIONS,
    SIZE_FRICTIONAL = N_FRICTIONAL > 0 ? N_FRICTIONAL : 1,
    FIRST_DIRECTION = N_ROWS,                        /* among the parameters */
    FIRST_OFFSET = FIRST_DIRECTION + N_FRICTIONAL,   /* among the parameters */
    FIRST_OFFSET_ROW = N_UNILATERALS                 /* among the positions */
};

/* All rows at some states. */
typedef struct {
    double positions[N_UNILATERALS + N_OFFSETS + 1]; /* gaps, then holonomic latches; one more: there may be none */
    double velocities[N_ROWS];
    double jacobian[N_ROWS * N_COORDINATES];
    double gamma[N_ROWS];
} ContactRows;

void rows_evaluate(const Instance *instance, double time, const double states[], const double inputs[],
                   ContactRows *rows);

/* Is the row a constraint in the present mode? */
bool row_active(const State *state, int row);

void row_activate(State *state, int row, bool active);

/* The direction in which a frictional row slides: 0 if it does not. */
double row_direction(const State *state, int row);

void row_direct(State *state, int row, double direction);

/* How much a change of the coordinates by their nominal values changes the position of a row. */
double row_size(const ContactRows *rows, int row);
=======
/* Rows of a Delassus operator and their laws: w = free + delassus lambda, where lambda are forces (impulses) and w
   accelerations (velocities) along the rows. Glocker, Set-Valued Force Laws, 2001. */
#ifndef CONTACT_ROWS_H
#define CONTACT_ROWS_H

#include <stdbool.h>

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
} Row;

typedef struct {
    int rows;
    const double *delassus; /* [rows * rows], row-major, symmetric, positive semidefinite; rows may be redundant */
    const double *free;     /* [rows] */
    const Row *row;         /* [rows] */
} Problem;
>>>>>>> laws

#endif
