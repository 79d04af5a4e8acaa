/* Runs without derivatives, by the chosen solver: each time that is asked for ends a communication step. */
#include <stdlib.h>

#include "integrator.h"
#include "study.h"

void *study_new(int directions) {
    Study *study = directions == 0 ? calloc(1, sizeof *study) : NULL;
    if (study != NULL) {
        study_begin(study);
    }
    return study;
}

void study_free(void *study) {
    free(study);
}

void study_reset(void *study) {
    study_begin(study);
}

/* Communication steps to a time (s), one to each knot of the signals. */
static bool reach(Instance *instance, const Request *request, double end) {
    while (instance->state.time < end) {
        study_drive(instance, request);
        const double next = study_next_knot(instance, request, end);
        if (!integrator_pass(instance, next) && !integrate(instance, next)) {
            return false;
        }
    }
    return true;
}

int study_run(void *handle, const Request *request) {
    Study *study = handle;
    Instance *instance = &study->instance;
    if (!study_solve_start(study, request) || !study_settle(study)) {
        return 0;
    }
    for (int i = 0; i < request->n_times; i++) {
        if (!reach(instance, request, request->times[i]) || !integrator_catch_up(instance) ||
            !study_read(instance, request, request->values + (size_t)i * (size_t)request->n_outputs)) {
            study_explain(study);
            return i;
        }
    }
    return request->n_times;
}
