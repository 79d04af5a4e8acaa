#include "intermediate_update.h"

#include <math.h>
#include <string.h>

#include "inputs.h"
#include "logging.h"

enum { SAMPLES = MAX_INPUT_ORDER + 1 }; /* of the inputs in a communication step, both ends included */

bool announce_intermediate(Importer *importer, const char *name, const fmi3ValueReference references[], size_t count) {
    if (count > 0 && references == NULL) {
        report_no_instance(importer, name, "the array of %u required intermediate variables is NULL", (unsigned)count);
        return false;
    }
    for (size_t i = 0; i < count; i++) {
        if (references[i] >= N_PORTS) {
            report_no_instance(importer, name, "there is no variable with value reference %u to be read or set in "
                               "intermediate updates; expected 0 to %d", references[i], N_PORTS - 1);
            return false;
        }
        importer->intermediate[references[i]] = true;
        importer->sets_inputs =
            importer->sets_inputs || VARIABLES[PORTS[references[i]].first].kind == VARIABLE_INPUT;
    }
    return true;
}

/* Hands over to the importer in intermediate update mode, at this time (s). Returns false after an error of the
   importer, which ends the communication step. */
static bool update(Component *component, double time, bool sets, bool *early, double *early_time) {
    Importer *importer = &component->importer;
    const Call call = component->call;
    const bool finished = !sets;
    set_mode(component, MODE_INTERMEDIATE_UPDATE);
    importer->may_set = sets;
    importer->may_get = !sets;
    importer->updating = true;
    importer->intermediate_update(importer->environment, time, sets, !sets, finished,
                                  importer->early_return_allowed && finished, early, early_time);
    importer->updating = false;
    component->call = call;
    if (component->session.mode != MODE_INTERMEDIATE_UPDATE) {
        return false;
    }
    set_mode(component, MODE_STEP);
    return true;
}

/* The listener's part, see Listener. */
static double follow_updates(void *owner, double end) {
    Component *component = (Component *)owner;
    const double time = component->instance.state.time;
    bool early = false;
    double early_time = time;
    if (!update(component, time, false, &early, &early_time)) {
        return time;
    }
    if (!early || !component->importer.early_return_allowed) {
        return end;
    }
    return early_time > time ? fmin(early_time, end) : time;
}

void offer_updates(Component *component) {
    component->instance.listener.follow = component->importer.intermediate_update != NULL ? follow_updates : NULL;
}

/* Makes an input the polynomial through values[SAMPLES], which are equally far apart in the communication step of this
   length (s): Newton's, expanded at its beginning. */
static void set_polynomial(Instance *instance, int input, const double values[], double length) {
    const double first = values[1] - values[0], next = values[2] - values[1], last = values[3] - values[2];
    const double second = next - first, third = last - next - second;
    const double rate = (SAMPLES - 1) / length;
    instance_assign(instance, &instance->state.inputs[input], values[0]);
    if (first == 0.0 && second == 0.0 && third == 0.0) {
        return;
    }
    inputs_set_derivative(instance, input, 1, rate * (first - second / 2.0 + third / 3.0));
    inputs_set_derivative(instance, input, 2, rate * rate * (second - third));
    inputs_set_derivative(instance, input, 3, rate * rate * rate * third);
}

bool ask_for_inputs(Component *component, double length) {
    Instance *instance = &component->instance;
    const double start = instance->state.time;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ROWS(mark, double, samples, SAMPLES, N_INPUTS);
    if (!component->importer.sets_inputs || component->importer.intermediate_update == NULL) {
        return arena_leave(mark, true);
    }
    for (int i = 0; i < SAMPLES; i++) {
        bool early = false; /* is not asked for here */
        double early_time = start;
        if (!update(component, start + length * ((double)i / (SAMPLES - 1)), true, &early, &early_time)) {
            return arena_leave(mark, false);
        }
        memcpy(samples[i], instance->state.inputs, sizeof samples[i]);
    }
    for (int k = 0; k < N_INPUTS; k++) {
        const double values[SAMPLES] = {samples[0][k], samples[1][k], samples[2][k], samples[3][k]};
        set_polynomial(instance, k, values, length);
    }
    return arena_leave(mark, true);
}
