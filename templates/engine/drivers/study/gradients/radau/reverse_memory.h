/* What the way back through steps of Radau IIA needs. */
#ifndef REVERSE_MEMORY_H
#define REVERSE_MEMORY_H

#include <string.h>

#include "directions.h"

/* What is kept of a step beside its ends, so that its equations need not be solved again. */
typedef struct {
    double accelerations[STAGES * N_RATES]; /* at its stages, with the derivatives of further states */
} StepRecord;

typedef struct {
    int none; /* C has no struct without members: the matrix is that of directions */
} ReverseMemory;

static inline void step_record_take(StepRecord *record, const Instance *instance) {
    memcpy(record->accelerations, instance->state.solver.accelerations, sizeof record->accelerations);
}

#endif
