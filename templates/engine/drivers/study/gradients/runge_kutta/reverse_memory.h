/* What the way back through steps of an explicit Runge-Kutta method needs. */
#ifndef REVERSE_MEMORY_H
#define REVERSE_MEMORY_H

#include "directions.h"

/* What is kept of a step beside its ends: nothing, its stages are computed again. */
typedef struct {
    int none; /* C has no struct without members */
} StepRecord;

typedef struct {
    double rows[STAGES + 1][STAGES];        /* a_ij of the stages, and b_j behind them */
    double dense[DENSE_TERMS][STAGES];      /* the terms of the interpolant by the stages, both in units of h */
    double states[STAGES][N_STATES];        /* of the stages */
    double stages[STAGES][N_STATES];        /* the derivatives by their slopes */
    double terms[DENSE_TERMS][N_STATES];    /* the derivatives by the terms of the interpolant */
} ReverseMemory;

static inline void step_record_take(StepRecord *record, const Instance *instance) {
    (void)instance;
    record->none = 0;
}

#endif
