/* Polynomials of time; all are expanded at the beginning of the communication step, so that nothing accumulates. */
#include "inputs.h"

#include <string.h>

#include "solver.h"

void inputs_prepare(State *state) {
    if (!state->input_derivatives_set) {
        memset(state->input_derivatives, 0, sizeof state->input_derivatives);
        state->input_derivatives_set = 1;
    }
}

/* Does any input move? */
static bool inputs_move(const State *state) {
    for (int order = 0; order < MAX_INPUT_ORDER; order++) {
        for (int i = 0; i < N_INPUTS; i++) {
            if (state->input_derivatives[order][i] != 0.0) {
                return true;
            }
        }
    }
    return false;
}

/* The derivatives of motions, where the importer gave none, as far as their velocities and accelerations tell them. */
static void continue_motions(State *state) {
    double *first = state->input_derivatives[0], *second = state->input_derivatives[1];
    for (int i = FIRST_MOTION; i < N_INPUTS; i += 3) {
        if (first[i] == 0.0 && second[i] == 0.0 && first[i + 1] == 0.0) {
            first[i] = state->inputs[i + 1];
            second[i] = first[i + 1] = state->inputs[i + 2];
        }
    }
}

void inputs_begin(Instance *instance) {
    State *state = &instance->state;
    const bool set = state->input_derivatives_set != 0;
    inputs_prepare(state);
    if (METHOD.variational) {
        continue_motions(state);
    }
    instance->scratch.inputs_move = (set || (METHOD.variational && N_MOTIONS > 0)) && inputs_move(state);
    instance->scratch.step_start = state->time;
}

const double *inputs_at(Instance *instance, double time) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const double s = time - scratch->step_start;
    if (!scratch->inputs_move) {
        return state->inputs;
    }
    for (int i = 0; i < N_INPUTS; i++) {
        const double third = state->input_derivatives[2][i], second = state->input_derivatives[1][i];
        const double first = state->input_derivatives[0][i];
        scratch->inputs[i] = state->inputs[i] + s * (first + s / 2.0 * (second + s / 3.0 * third));
    }
    return scratch->inputs;
}

void inputs_end(Instance *instance) {
    State *state = &instance->state;
    const double s = state->time - instance->scratch.step_start;
    state->input_derivatives_set = 0;
    if (!instance->scratch.inputs_move) {
        return;
    }
    memcpy(state->inputs, inputs_at(instance, state->time), sizeof state->inputs);
    for (int i = 0; i < N_INPUTS; i++) {
        const double third = state->input_derivatives[2][i], second = state->input_derivatives[1][i];
        state->input_derivatives[0][i] += s * (second + s / 2.0 * third);
        state->input_derivatives[1][i] += s * third;
    }
}
