/* One run of a batch in the engine of the FMU, and what is watched of it on its way. */
#ifndef SCALAR_RUN_H
#define SCALAR_RUN_H

#include "batch.h"
#include "instance.h"

enum {
    AT_UNKNOWNS = N_STATES,
    AT_FURTHER_RATES = AT_UNKNOWNS + N_UNKNOWNS,
    AT_LOCALS = AT_FURTHER_RATES + N_FURTHER,
    AT_INPUTS = AT_LOCALS + N_LOCALS,
    N_QUANTITIES = AT_INPUTS + N_INPUTS,
    N_WATCHED_EVENTS = N_EVENTS + N_UNILATERALS /* indicators that come to 0, and behind them impacts */
};

/* The events that have been noted so far, and what tells that there are new ones. */
typedef struct {
    double time;             /* s; the time of the last event */
    int64_t there, passed;   /* how many events there were at that time, and in all so far */
    int64_t pending;         /* due[] holds the functions of the event that comes next */
    int64_t due[SIZE_EVENTS];
    int64_t impacts[SIZE_UNILATERALS];
    int64_t counts[N_WATCHED_EVENTS + 1];
} Noted;

/* A point of the run, from which it can be gone on with. */
typedef struct {
    State state;
    Noted noted;
    double quantities[N_QUANTITIES];
} Point;

typedef struct {
    Instance instance;
    const Batch *batch;
    int64_t run, sample, knot;
    Noted noted;
    double quantities[N_QUANTITIES]; /* at the present point */
    Point earlier, before, present;  /* the last three points at which zeros were looked for */
    Point between;                   /* a point between these at which a quantity has another sign */
    int64_t points;                  /* how many points before the present one are known since the last knot */
} Run;

/* Sets run->quantities to those at the present point. */
bool run_evaluate(Run *run);

/* Sets the inputs from the present knot on, as polynomials of first order. */
void run_set_inputs(Run *run);

/* Integrates to a time (s), which no sample and no knot stand before. */
bool run_advance(Run *run, double time);

/* Begins to watch a run at its start, where run->quantities are known. */
void watch_start(Run *run);

/* Goes on behind a knot, at which inputs may jump and quantities with them. */
bool watch_knot(Run *run);

/* Integrates to a time (s), in parts in which extremes and zeros are looked for if they were asked for. */
bool watch_to(Run *run, double time);

/* The events are over: their counts go to the batch. */
void watch_end(Run *run);

#endif
