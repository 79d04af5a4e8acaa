/* The rows of contacts, stops, dry frictions and latches, whatever their modes.

   Rows stand in this order: the gaps of the N_UNILATERALS contacts and stops; their slips, those of contact i from
   SLIP_ROWS[i] up to SLIP_ROWS[i + 1]; dry frictions; latches, the holonomic ones first. Among the constraints row r
   has the place ROW_PLACES[r]. Slips and dry frictions are frictional rows: they may slide. */
#ifndef ELEMENT_ROWS_H
#define ELEMENT_ROWS_H

#include "instance.h"

enum {
    DISSIPATED = N_STATES - 1, /* among the states: the energy that dampers, friction and impacts have taken */
    FIRST_SLIP = N_UNILATERALS,
    FIRST_FRICTION = N_UNILATERALS + N_SLIPS,
    FIRST_LATCH = FIRST_FRICTION + N_FRICTIONS,
    N_FRICTIONAL = N_SLIPS + N_FRICTIONS,
    SIZE_FRICTIONAL = N_FRICTIONAL > 0 ? N_FRICTIONAL : 1,
    FIRST_DIRECTION = N_ROWS,                        /* among the parameters */
    FIRST_OFFSET = FIRST_DIRECTION + N_FRICTIONAL,   /* among the parameters */
    FIRST_OUTLOOK = FIRST_OFFSET + N_OFFSETS,        /* among the parameters */
    SLIPS_IN_SPACE = N_MASKS > FIRST_OUTLOOK,        /* is there a contact with two slips? */
    FIRST_OFFSET_ROW = N_UNILATERALS                 /* among the positions */
};

/* All rows at some states. */
typedef struct {
    double positions[N_UNILATERALS + N_OFFSETS + 1]; /* gaps, then holonomic latches; one more: there may be none */
    double velocities[N_ROWS];
    double jacobian[N_ROWS * N_COORDINATES];
    double gamma[N_ROWS];
} ElementRows;

void rows_evaluate(const Instance *instance, double time, const double states[], const double inputs[],
                   ElementRows *rows);

/* Is the row a constraint in the present mode? */
static inline bool row_active(const State *state, int row) {
    return state->parameters[row] != 0.0;
}

void row_activate(State *state, int row, bool active);

/* The direction in which a frictional row slides: 0 if it does not. A contact in space has two rows; its direction is a
   velocity in m/s or rad/s, and friction is against the sum of it, the slip, and what its outlook adds. */
static inline double row_direction(const State *state, int row) {
    return state->parameters[FIRST_DIRECTION + row - FIRST_SLIP];
}

void row_direct(State *state, int row, double direction);

/* The rate of change of a row's velocity, m/s^2 or rad/s^2, at the accelerations qdd[N_COORDINATES]. */
double row_acceleration(const ElementRows *rows, int row, const double qdd[]);

/* How much a change of the coordinates by their nominal values changes the position of a row. */
double row_size(const ElementRows *rows, int row);

/* The pace (1/s) of a motion that shows in the experiment: 1/s, less in a long one, more in a short one. */
double states_least_pace(const State *state);

/* The greatest velocity of the states in nominal values (1/s), not below the least pace. */
double states_pace(const State *state);

/* A velocity along a row that is as good as 0. */
double row_least_speed(const State *state, const ElementRows *rows, int row);

#endif
