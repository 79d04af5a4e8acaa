/* A batch of runs of one mechanism, as the caller describes it; lanes and the scalar engine read the same record.

   All values are in SI units. The quantities that can be asked for stand in one vector: states x = (q, qd, z); the
   unknowns (qdd, multipliers); the derivatives of z; the locals y; the inputs u. */
#ifndef BATCH_H
#define BATCH_H

#include <stdint.h>

enum {
    RUN_WAITS = 0,
    RUN_DONE = 1,
    RUN_LEFT = 2,   /* the run has left its lane and waits for the scalar engine */
    RUN_FAILED = 3  /* the scalar engine could not complete the run, and gave the reason */
};

#define BATCH_STOPPED ((int64_t)1 << 62) /* if *next has this value, all threads end as soon as they can */

/* [a][b] are the shapes of arrays. Columns are indices in the vector of quantities. */
typedef struct {
    int64_t runs, samples, outputs, extremes, crossings, most_crossings, events, most_events, knots;
    int64_t inputs_apart;         /* 1: each run has its own inputs, 0: all have the same */
    int64_t hold;                 /* 1: inputs keep their values between knots, 0: they are linear there */
    double start_time;            /* s */
    double tolerance;             /* relative */
    const double *starts;         /* [runs][states] */
    const double *parameters;     /* [runs][parameters] */
    const double *stop_times;     /* s, [runs] */
    const double *steps;          /* s, [runs]; the fixed step, or the first one of adaptive methods, 0: automatic */
    const double *longest_steps;  /* s, [runs] */
    const double *nominals;       /* [states] */
    const double *knot_times;     /* s, [knots], the first one is the start time */
    const double *inputs;         /* [runs or 1][knots][inputs] */
    const double *sample_times;   /* s, [samples], ascending */
    const int64_t *output_columns, *extreme_columns, *crossing_columns;
    const int64_t *event_kinds;   /* [events]; indicators, and behind them the impacts of contacts */
    double *finals;               /* [runs][outputs] */
    double *sampled;              /* [runs][samples][outputs] */
    double *minima, *maxima;      /* [runs][extremes] */
    double *crossed;              /* s, [runs][crossings][most_crossings] */
    int64_t *crossing_counts;     /* [runs][crossings]; may be more than most_crossings, which are stored */
    double *event_times;          /* s, [runs][events][most_events]; of events in the scalar engine, lanes have none */
    int64_t *event_counts;        /* [runs][events]; may be more than most_events, which are stored */
    double *reached;              /* s, [runs] */
    int64_t *accepted;            /* [runs]; solver steps */
    int64_t *status;              /* [runs] */
    int64_t *next;                /* the next run that waits, shared by all threads */
    char *reasons;                /* [runs][1024], of runs that failed in the scalar engine; lanes write none */
} Batch;

static inline int batch_stopped(const Batch *batch) {
    return __atomic_load_n(batch->next, __ATOMIC_RELAXED) >= BATCH_STOPPED;
}

#endif
