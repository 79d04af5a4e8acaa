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
    Variations *variations = calloc(1, own + ARENA_HEAD + ARENA_CAPACITY);
    if (variations != NULL) {
        Arena *arena = arena_begin((char *)variations + own, ARENA_CAPACITY);
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
    memset(variations->directions, 0, (size_t)variations->count * sizeof(Direction));
}

void study_seed(void *study, int direction, int reference, double change, double scale) {
    Direction *varied = &((Variations *)study)->directions[direction];
    *value_in_seed(&varied->seed, &VARIABLES[reference]) += change;
    varied->scale = scale;
}

/* The start and how it answers to the directions; then the modes that hold there. */
static bool begin_run(Variations *variations, const Request *request) {
    Study *study = &variations->study;
    if (!study_solve_start(study, request)) {
        return false;
    }
    variations->probe.policy = study->instance.policy;
    variations->probe.listener = study->instance.listener;
    return directions_start(variations);
}

/* Stretches between knots up to the last time; *next is the sample that comes. */
static bool run(Variations *variations, const Request *request, int *next) {
    Instance *instance = &variations->study.instance;
    const double stop = request->times[request->n_times - 1];
    double end = instance->state.time;
    bool first = true;
    while (first || end < stop) {
        if (!first) {
            study_drive(instance, request);
        }
        end = first ? end : study_next_knot(instance, request, stop);
        first = false;
        if (!directions_integrate(variations, request, end, next)) {
            return false;
        }
        for (; *next < request->n_times && request->times[*next] <= end; (*next)++) {
            for (int d = 0; d < variations->count; d++) {
                Direction *direction = &variations->directions[d];
                memcpy(direction->seed.states, direction->states, sizeof direction->states);
            }
            if (!directions_sample(variations, request, *next, end, instance->state.states)) {
                return false;
            }
        }
    }
    return true;
}

int study_run(void *handle, const Request *request) {
    Variations *variations = handle;
    int next = 0;
    if (begin_run(variations, request) && !run(variations, request, &next) && variations->study.message[0] == '\0') {
        study_explain(&variations->study);
    }
    return next;
}
