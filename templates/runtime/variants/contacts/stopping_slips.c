#include "stopping_slips.h"

#include <math.h>

#include "inputs.h"

enum { FUNCTIONS = 2 * N_UNILATERALS + N_FRICTIONS };

static bool is_friction(int function) {
    return function >= 2 * N_UNILATERALS;
}

static int row_of(int function) {
    return is_friction(function) ? FIRST_FRICTION + function - 2 * N_UNILATERALS : SLIP_ROWS[function / 2];
}

static bool slides_along_a_line(const State *state, int function) {
    const int contact = function / 2;
    return is_friction(function)
               ? !friction_sticks(state, function - 2 * N_UNILATERALS)
               : function % 2 == 1 && contact_slides(state, contact) && contact_slips(contact) == 1;
}

bool slips_stop(Settling *settling, StoppingSlips *slips) {
    State *state = &settling->instance->state;
    bool found = false;
    for (int function = 0; function < FUNCTIONS; function++) {
        slips->direction[function] = 0.0;
        if (!settling->due[function] || !slides_along_a_line(state, function)) {
            continue;
        }
        slips->direction[function] = row_direction(state, row_of(function));
        if (is_friction(function)) {
            friction_stick(state, function - 2 * N_UNILATERALS);
        } else {
            contact_stick(state, function / 2);
        }
        settling->due[function] = false;
        found = true;
    }
    return found;
}

void slips_pass(Settling *settling, const StoppingSlips *slips) {
    Instance *instance = settling->instance;
    State *state = &instance->state;
    rows_evaluate(instance, state->time, state->states, inputs_at(instance, state->time), &settling->rows);
    for (int function = 0; function < FUNCTIONS; function++) {
        const double other = -slips->direction[function], speed = fabs(settling->rows.velocities[row_of(function)]);
        double *rest = &state->event_rests[N_SWITCHES + function];
        if (other == 0.0) {
            continue;
        }
        if (is_friction(function)) {
            friction_slide(state, function - 2 * N_UNILATERALS, other);
        } else {
            contact_slide(state, function / 2, &other, 0.0);
        }
        *rest = fmax(*rest, 2.0 * speed);
    }
}

double slip_located(const Settling *settling, int row, int function) {
    const State *state = &settling->instance->state;
    const double velocity = settling->velocity[ROW_PLACES[row]], direction = row_direction(state, row);
    return fabs(velocity) <= state->event_rests[N_SWITCHES + function] && direction != 0.0
               ? direction * fabs(velocity)
               : velocity;
}
