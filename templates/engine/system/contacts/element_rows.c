#include "element_rows.h"

#include <math.h>

#include "scale.h"
#include "settings.h"

/* In nominal values of the coordinates: how far the least pace takes them in the experiment, at least and at most. The
   least pace is 1/s in experiments of 0.1 s to 100 s, and one of these over the duration in shorter and longer ones. */
static const double LEAST_WAY = 0.1, GREATEST_WAY = 100.0;

void rows_evaluate(const Instance *instance, double time, const double states[], const double inputs[],
                   ElementRows *rows) {
    mechanism_rows(time, states, inputs, instance->state.parameters, rows->positions, rows->velocities, rows->jacobian,
                   rows->gamma);
}

void row_activate(State *state, int row, bool active) {
    state->parameters[row] = active ? 1.0 : 0.0;
}

void row_direct(State *state, int row, double direction) {
    state->parameters[FIRST_DIRECTION + row - FIRST_SLIP] = direction;
}

double row_acceleration(const ElementRows *rows, int row, const double qdd[]) {
    double change = rows->gamma[row];
    for (int i = 0; i < N_COORDINATES; i++) {
        change += rows->jacobian[row * N_COORDINATES + i] * qdd[i];
    }
    return change;
}

double row_size(const ElementRows *rows, int row) {
    double size = 0.0;
    for (int i = 0; i < N_COORDINATES; i++) {
        size = fmax(size, fabs(rows->jacobian[row * N_COORDINATES + i]) * NOMINAL_STATES[i]);
    }
    return size > 0.0 ? size : 1.0;
}

double states_least_pace(const State *state) {
    const double duration = experiment_duration(state);
    return fmax(LEAST_WAY / duration, fmin(1.0, GREATEST_WAY / duration));
}

double states_pace(const State *state) {
    double greatest = states_least_pace(state);
    for (int i = 0; i < N_COORDINATES; i++) {
        greatest = fmax(greatest, fabs(state->states[N_COORDINATES + i]) / NOMINAL_STATES[i]);
    }
    return greatest;
}

double row_least_speed(const State *state, const ElementRows *rows, int row) {
    return AT_REST * states_pace(state) * row_size(rows, row);
}
