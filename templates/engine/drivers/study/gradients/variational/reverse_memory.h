/* What the way back through steps of a variational method needs. */
#ifndef REVERSE_MEMORY_H
#define REVERSE_MEMORY_H

#include "directions.h"

/* What is kept of a step beside its ends, so that its equations need not be solved again. */
typedef struct {
    SolverScratch stages;
} StepRecord;

typedef struct {
    int none; /* C has no struct without members: the matrix is that of directions */
} ReverseMemory;

static inline void step_record_take(StepRecord *record, const Instance *instance) {
    record->stages = instance->scratch.solver;
}

#endif
