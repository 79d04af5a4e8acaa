/* What the way back through steps of ROS2 needs. */
#ifndef REVERSE_MEMORY_H
#define REVERSE_MEMORY_H

#include "directions.h"

/* What is kept of a step beside its ends: nothing, its stages are computed again. */
typedef struct {
    int none; /* C has no struct without members */
} StepRecord;

typedef struct {
    int none;
} ReverseMemory;

static inline void step_record_take(StepRecord *record, const Instance *instance) {
    (void)instance;
    record->none = 0;
}

#endif
