/* Polynomials of time; all are expanded at the beginning of the communication step, so that nothing accumulates. */
#include "inputs.h"

#include <string.h>

/* Sets a derivative; where the equations contain rates of inputs, what followed from it is outdated. */
static void set_rate(Instance *instance, double *slot, double value) {
    if (N_SIGNALS > N_INPUTS) {
        instance_assign(instance, slot, value);
    } else {
        *slot = value;
    }
}

/* Forgets the derivatives of a finished step, before the first one is set for the next. */
static void prepare(Instance *instance) {
    State *state = &instance->state;
    if (!state->input_derivatives_set) {
        for (int i = 0; i < MAX_INPUT_ORDER * N_INPUTS; i++) {
            set_rate(instance, input_derivatives(state, 1) + i, 0.0);
        }
        state->input_derivatives_set = 1;
    }
}

void inputs_set_derivative(Instance *instance, int input, int order, double value) {
    prepare(instance);
    set_rate(instance, input_derivatives(&instance->state, order) + input, value);
}

/* Does any input move? */
static bool inputs_move(State *state) {
    const double *derivatives = input_derivatives(state, 1);
    for (int i = 0; i < MAX_INPUT_ORDER * N_INPUTS; i++) {
        if (derivatives[i] != 0.0) {
            return true;
        }
    }
    return false;
}

/* Gives motions for which the importer set no derivatives those that their velocities and accelerations tell. */
static void continue_motions(State *state) {
    double *first = input_derivatives(state, 1), *second = input_derivatives(state, 2);
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
    prepare(instance);
    continue_motions(state);
    instance->scratch.inputs_move = (set || N_MOTIONS > 0) && inputs_move(state);
    instance->scratch.step_start = state->time;
}

const double *inputs_at(Instance *instance, double time) {
    State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const double s = time - scratch->step_start;
    if (!scratch->inputs_move) {
        return state->inputs;
    }
    const double *first = input_derivatives(state, 1), *second = input_derivatives(state, 2);
    const double *third = input_derivatives(state, 3);
    for (int i = 0; i < N_INPUTS; i++) {
        scratch->inputs[i] = state->inputs[i] + s * (first[i] + s / 2.0 * (second[i] + s / 3.0 * third[i]));
    }
    for (int i = 0; i < N_INPUTS && N_SIGNALS > N_INPUTS; i++) {
        scratch->inputs[N_INPUTS + i] = first[i] + s * (second[i] + s / 2.0 * third[i]);
        scratch->inputs[2 * N_INPUTS + i] = second[i] + s * third[i];
    }
    return scratch->inputs;
}

void inputs_end(Instance *instance) {
    State *state = &instance->state;
    const double s = state->time - instance->scratch.step_start;
    double *first = input_derivatives(state, 1), *second = input_derivatives(state, 2);
    const double *third = input_derivatives(state, 3);
    state->input_derivatives_set = 0;
    if (!instance->scratch.inputs_move) {
        return;
    }
    memcpy(state->inputs, inputs_at(instance, state->time), N_INPUTS * sizeof(double));
    instance->scratch.inputs_move = false; /* from here on they are those of the State */
    for (int i = 0; i < N_INPUTS; i++) {
        first[i] += s * (second[i] + s / 2.0 * third[i]);
        second[i] += s * third[i];
    }
}
