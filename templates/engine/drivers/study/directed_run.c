/* Runs with derivatives. */
#include <stdlib.h>
#include <string.h>

#include "arena_size.h"
#include "directions.h"
#include "values.h"

/* Adds to a direction the change of a variable; scale: a typical size of what is varied. */
STUDY_EXPORT void study_seed(void *study, int direction, int reference, double change, double scale);

void *study_new(int directions) {
    const size_t own = arena_bytes(sizeof(Variations) + (size_t)directions * sizeof(Direction), 1);
    Variations *variations = (Variations *)calloc(1, own + ARENA_HEAD + ARENA_CAPACITY);
    if (variations != NULL) {
        Arena *arena = arena_begin((char *)variations + own, ARENA_CAPACITY, ARENA_WORK);
        instance_work_in(&variations->study.instance, arena);
        instance_work_in(&variations->probe, arena); /* they work in turn */
        variations->count = directions;
        study_reset(variations);
    }
    return variations;
}

void study_free(void *study) {
    if (study != NULL) {
        arena_end(((Variations *)study)->study.instance.arena);
        free(study);
    }
}

void study_reset(void *study) {
    Variations *variations = study;
    study_begin(&variations->study);
    for (int d = 0; d < variations->count; d++) { /* the rest is written before it is read */
        Direction *direction = &variations->directions[d];
        memset(&direction->seed, 0, sizeof direction->seed);
        memset(direction->states, 0, sizeof direction->states);
    }
}

void study_seed(void *study, int direction, int reference, double change, double scale) {
    Direction *varied = &((Variations *)study)->directions[direction];
    *value_in_seed(&varied->seed, &VARIABLES[reference]) += change;
    varied->scale = scale;
}

bool directions_begin(Variations *variations) {
    Study *study = &variations->study;
    if (!study_solve_start(study, variations->request)) {
        return false;
    }
    variations->probe.policy = study->instance.policy;
    variations->probe.listener = study->instance.listener;
    return directions_start(variations);
}

/* Samples at the present point. */
static bool sample_here(Variations *variations) {
    const State *state = &variations->study.instance.state;
    const Request *request = variations->request;
    while (variations->next < request->n_times && request->times[variations->next] <= state->time) {
        for (int d = 0; d < variations->count; d++) {
            Direction *direction = &variations->directions[d];
            memcpy(direction->seed.states, direction->states, sizeof direction->states);
        }
        if (!directions_sample(variations, state->time, state->states)) {
            return false;
        }
        variations->next++;
    }
    return true;
}

/* The end (s) of the stretch that begins: at a knot, or at the next sample if steps hold none. */
static double stretch_end(const Variations *variations, double stop) {
    const Request *request = variations->request;
    const double knot = study_next_knot(&variations->study.instance, request, stop);
    return STEPS_HOLD_SAMPLES || knot < request->times[variations->next] ? knot : request->times[variations->next];
}

bool study_stretches(Variations *variations, bool (*integrate)(Variations *variations, double end),
                     bool (*sample)(Variations *variations)) {
    Instance *instance = &variations->study.instance;
    const Request *request = variations->request;
    const double stop = request->times[request->n_times - 1];
    double end = instance->state.time;
    bool first = true;
    while (first || end < stop) {
        if (!first) {
            study_drive(instance, request);
        }
        end = first ? end : stretch_end(variations, stop);
        first = false;
        if (!integrate(variations, end) || !sample(variations)) {
            return false;
        }
    }
    return true;
}

int study_run(void *handle, const Request *request) {
    Variations *variations = handle;
    variations->request = request;
    variations->next = 0;
    if (directions_begin(variations) && !study_stretches(variations, directions_integrate, sample_here) &&
        variations->study.message[0] == '\0') {
        study_explain(&variations->study);
    }
    return variations->next;
}
