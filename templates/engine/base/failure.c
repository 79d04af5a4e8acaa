/* Keeping why an evaluation failed. */
#include "failure.h"

#include <math.h>
#include <string.h>

static bool report_at(Instance *instance, FailureKind kind, double time) {
    instance->failure.kind = kind;
    instance->failure.time = time;
    return false;
}

bool report_amount(Instance *instance, FailureKind kind, double time, double amount) {
    instance->failure.amount = amount;
    return report_at(instance, kind, time);
}

bool report_event(Instance *instance, FailureKind kind, double time, int event) {
    instance->failure.event = event;
    return report_at(instance, kind, time);
}

bool report_constraint(Instance *instance, FailureKind kind, double time, int constraint, double amount) {
    instance->failure.count = constraint;
    return report_amount(instance, kind, time, amount);
}

bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]) {
    memcpy(instance->failure.coordinates, coordinates, sizeof instance->failure.coordinates);
    return report_at(instance, kind, time);
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
