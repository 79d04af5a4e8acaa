/* All runs of a batch in lanes, from any number of threads at once: each has its own group and takes runs from the
   queue that they share. */
#include <stdlib.h>
#include <string.h>

#include "lane_group.h"

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

/* The size of what lane_runs works in, with room to align it. */
EXPORTED int64_t lane_memory(void);
EXPORTED void lane_runs(const Batch *batch, char *memory);
EXPORTED int64_t lane_count(void);

/* What a new point takes: the derivatives there, at the start also a first step and what was asked for. */
static void prepare(Group *group) {
    Lanes unknowns[N_UNKNOWNS], derivatives[N_STATES];
    const Mask stale = group->stale, fresh = group->fresh;
    if (lanes_any(fresh)) {
        group_begin_constraints(group, fresh);
    }
    group_derivative(group, stale, group->time, group->states, unknowns, derivatives);
    for (int i = 0; i < N_STATES; i++) {
        lanes_put(&group->stages[0][i], stale, derivatives[i]);
    }
    method_begin(group, stale);
    if (lanes_any(fresh)) {
        const Mask unknown = fresh & ~(Mask)(group->next_step > 0.0);
        if (ERROR_ORDER > 0 && lanes_any(unknown)) {
            group_first_step(group, unknown);
        }
        group_record_start(group, fresh);
    }
    group->stale = group->fresh = (Mask){0};
}

EXPORTED int64_t lane_memory(void) {
    return (int64_t)sizeof(Group) + 256;
}

EXPORTED int64_t lane_count(void) {
    return LANES;
}

/* memory has lane_memory() bytes. */
EXPORTED void lane_runs(const Batch *batch, char *memory) {
    Group *group = (Group *)(void *)(memory + (256 - (uintptr_t)memory % 256));
    memset(group, 0, sizeof *group);
    group->batch = batch;
    group_fill(group);
    while (lanes_any(group->active) && !batch_stopped(batch)) {
        if (lanes_any(group->stale)) {
            prepare(group);
        }
        group_step(group);
        const Mask lost = group->active & group->lost;
        if (lanes_any(lost)) {
            group_end_runs(group, lost, RUN_LEFT);
        }
        const Mask done = group->active & (Mask)(group->time >= group->stop);
        if (lanes_any(done)) {
            group_record_end(group, done);
            const Mask late = done & group->lost;
            group_end_runs(group, late, RUN_LEFT);
            group_end_runs(group, done & ~late, RUN_DONE);
        }
        if (!(lanes_any(~group->active))) {
            continue;
        }
        group_fill(group);
    }
}
