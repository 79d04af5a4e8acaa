/* Keeping why an evaluation failed. */
#include "failure.h"

#include <math.h>
#include <string.h>

bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]) {
    instance->failure.kind = kind;
    instance->failure.time = time;
    memcpy(instance->failure.coordinates, coordinates, sizeof instance->failure.coordinates);
    return false;
}

bool report_accelerations(Instance *instance, double time, const double accelerations[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, bool, concerned, N_COORDINATES);
    for (int i = 0; i < N_COORDINATES; i++) {
        concerned[i] = !isfinite(accelerations[i]);
    }
    instance->failure.imported = !instance->policy->integrate;
    return arena_leave(mark, report_coordinates(instance, FAILURE_NOT_FINITE, time, concerned));
}
