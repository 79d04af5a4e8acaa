#include "study.h"

#include <math.h>
#include <stdio.h>

#include "diagnosis.h"
#include "equations.h"
#include "events.h"
#include "failure_sentence.h"
#include "inputs.h"
#include "massless.h"
#include "values.h"

void study_begin(Study *study) {
    study->instance.policy = &OWN_SOLVER;
    study->instance.listener = (Listener){0};
    study->message[0] = '\0';
    instance_start(&study->instance);
}

void study_set(void *study, int count, const int references[], const double values[]) {
    Instance *instance = &((Study *)study)->instance;
    for (int i = 0; i < count; i++) {
        instance_assign(instance, value_slot(instance, &VARIABLES[references[i]]), values[i]);
    }
}

const char *study_message(const void *study) {
    return ((const Study *)study)->message;
}

bool study_explain(Study *study) {
    explain_failure(&study->instance);
    failure_sentence(&study->instance.failure, study->message, sizeof study->message);
    return false;
}

bool study_solve_start(Study *study, const Request *request) {
    Instance *instance = &study->instance;
    State *state = &instance->state;
    instance_assign(instance, &state->time, request->start);
    state->start_time = request->start;
    state->stop_time = request->times[request->n_times - 1];
    state->stop_time_defined = 1;
    state->tolerance = request->tolerance;
    instance_forget_cache(instance);
    study_drive(instance, request);
    state->phase = PHASE_SOLVING_START;
    return equations_settle(instance) || study_explain(study);
}

bool study_settle(Study *study) {
    Instance *instance = &study->instance;
    bool jumped;
    if (!events_refresh(instance, &jumped)) {
        return study_explain(study);
    }
    massless_keep(&instance->state);
    instance->state.phase = PHASE_RUNNING;
    return true;
}

/* The last knot that is not after the time (s), -1 if there is none. */
static int knot_before(const Request *request, double time) {
    int low = -1, high = request->n_knots;
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (request->knots[middle] <= time) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

void study_drive(Instance *instance, const Request *request) {
    State *state = &instance->state;
    const int knot = knot_before(request, state->time);
    const bool moves = knot >= 0 && knot + 1 < request->n_knots && !request->hold;
    for (int i = 0; i < request->n_inputs && request->n_knots > 0; i++) {
        const int input = VARIABLES[request->inputs[i]].index;
        const double *signal = request->signals + (knot < 0 ? 0 : knot) * request->n_inputs + i;
        double rate = 0.0, passed = 0.0;
        if (moves) {
            rate = (signal[request->n_inputs] - signal[0]) / (request->knots[knot + 1] - request->knots[knot]);
            passed = state->time - request->knots[knot];
        }
        instance_assign(instance, &state->inputs[input], signal[0] + rate * passed);
        inputs_set_derivative(instance, input, 1, rate);
    }
}

double study_next_knot(const Instance *instance, const Request *request, double end) {
    const int next = knot_before(request, instance->state.time) + 1;
    return next < request->n_knots && request->knots[next] < end ? request->knots[next] : end;
}

bool study_read(Instance *instance, const Request *request, double values[]) {
    for (int i = 0; i < request->n_outputs; i++) {
        const Variable *variable = &VARIABLES[request->outputs[i]];
        if (value_is_integer(variable->kind)) {
            values[i] = value_integer(instance, variable);
            continue;
        }
        if (!value_update(instance, variable->kind)) {
            return false;
        }
        values[i] = *value_slot(instance, variable);
    }
    return true;
}
