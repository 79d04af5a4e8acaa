#include "stopping_slips.h"

#include <math.h>
#include <string.h>

enum { FUNCTIONS = 2 * N_UNILATERALS + N_FRICTIONS };

static bool is_friction(int function) {
    return N_FRICTIONS > 0 && function >= 2 * N_UNILATERALS;
}

static int row_of_function(int function) {
    return is_friction(function) ? FIRST_FRICTION + function - 2 * N_UNILATERALS : SLIP_ROWS[function / 2];
}

static bool slides_along_a_line(const State *state, int function) {
    const int contact = function / 2;
    return is_friction(function)
               ? !friction_sticks(state, function - 2 * N_UNILATERALS)
               : function % 2 == 1 && contact_slides(state, contact) && contact_slips(contact) == 1;
}

bool slips_find(Settling *settling, StoppingSlips *slips) {
    const State *state = &settling->instance->state;
    bool found = false;
    memset(slips, 0, sizeof *slips);
    for (int function = 0; function < FUNCTIONS; function++) {
        if (settling->due[function] && slides_along_a_line(state, function)) {
            slips->direction[function] = row_direction(state, row_of_function(function));
            settling->stopping[function] = true;
            settling->due[function] = false;
            found = true;
        }
    }
    return found;
}

void slips_forget_moving(Settling *settling, StoppingSlips *slips) {
    const State *state = &settling->instance->state;
    for (int function = 0; function < FUNCTIONS; function++) {
        const int row = row_of_function(function);
        if (slips->direction[function] * settling->velocity[ROW_PLACES[row]] >
            row_least_speed(state, &settling->rows, row)) {
            slips->direction[function] = 0.0;
            settling->stopping[function] = false;
        }
    }
}

static void stick(State *state, int function) {
    if (is_friction(function)) {
        friction_stick(state, function - 2 * N_UNILATERALS);
    } else {
        contact_stick(state, function / 2);
    }
}

/* Slides on in the other direction. A velocity that still has the sign of the old direction is an error of the event's
   location. */
static void turn_slip(Settling *settling, int function, double direction) {
    State *state = &settling->instance->state;
    const double other = -direction, wrong = direction * settling->velocity[ROW_PLACES[row_of_function(function)]];
    double *rest = &state->event_rests[N_SWITCHES + function];
    if (is_friction(function)) {
        friction_slide(state, function - 2 * N_UNILATERALS, other);
    } else {
        contact_slide(state, function / 2, &other, NO_OUTLOOK);
    }
    *rest = fmax(*rest, 2.0 * wrong);
}

/* Could friction have made the speed of this row in the last step, when it turned from one of its limits to the
   other? */
static bool within_step(const Settling *settling, int k) {
    const Row *row = &settling->row[k];
    const double limit = row->law == ROW_TANGENTIAL ? row->holding * settling->lambda[row->normal] : row->holding;
    const double change = 2.0 * limit * settling->delassus[k * K + k];
    return fabs(settling->velocity[k]) <= change * settling_last_step(settling->instance);
}

/* Does friction hold the row of a slip that stops? */
static bool holds(const Settling *settling, int k) {
    const RowLaw law = settling->row[k].law;
    return (law == ROW_BOUNDED || law == ROW_TANGENTIAL) && settling->w[k] == 0.0 && !settling->determined[k];
}

void slips_stop(Settling *settling, StoppingSlips *slips) {
    const bool solved = settling_laws(settling);
    slips->within_step = solved;
    for (int function = 0; function < FUNCTIONS; function++) {
        const int k = ROW_PLACES[row_of_function(function)];
        if (!settling->stopping[function]) {
            continue;
        }
        settling->stopping[function] = false;
        if (!solved || holds(settling, k)) {
            stick(&settling->instance->state, function);
            slips->stopped = true;
            slips->within_step = slips->within_step && within_step(settling, k);
        } else {
            turn_slip(settling, function, slips->direction[function]);
            slips->direction[function] = 0.0;
        }
    }
}

void slips_pass(Settling *settling, const StoppingSlips *slips) {
    for (int function = 0; function < FUNCTIONS; function++) {
        if (slips->direction[function] != 0.0) {
            turn_slip(settling, function, slips->direction[function]);
        }
    }
}
