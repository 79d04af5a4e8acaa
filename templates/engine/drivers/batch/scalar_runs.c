/* Runs of a batch one by one, by the very engine of the FMU: the runs that cannot go in lanes, and all starts that
   constraints determine. */
#include <math.h>
#include <string.h>

#include "arena_size.h"
#include "diagnosis.h"
#include "equations.h"
#include "events.h"
#include "failure_sentence.h"
#include "massless.h"
#include "scalar_run.h"

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

EXPORTED int64_t scalar_memory(void);
EXPORTED void scalar_starts(const Batch *batch, char *memory, double settled[]);
EXPORTED void scalar_runs(const Batch *batch, char *memory);

static void store(const Run *run, double place[]) {
    const Batch *batch = run->batch;
    for (int64_t i = 0; i < batch->outputs; i++) {
        place[i] = run->quantities[batch->output_columns[i]];
    }
}

/* Starts a run, up to what follows from its start values. */
static bool begin_scalar_run(Run *run, int64_t number) {
    const Batch *batch = run->batch;
    Instance *instance = &run->instance;
    State *state = &instance->state;
    bool jumped;
    Arena *arena = instance->arena;
    memset(instance, 0, sizeof *instance);
    instance_work_in(instance, arena);
    instance->policy = &OWN_SOLVER;
    instance_start(instance);
    run->run = number;
    run->sample = run->knot = 0;
    memcpy(state->states, batch->starts + number * N_STATES, sizeof state->states);
    memcpy(state->parameters, batch->parameters + number * N_PARAMETERS, N_PARAMETERS * sizeof(double));
    state->time = state->start_time = batch->start_time;
    state->stop_time_defined = 1;
    state->stop_time = batch->stop_times[number];
    state->tolerance = batch->tolerance;
    state->settings[SETTING_STEP] = batch->steps[number];
    state->settings[SETTING_MAX_STEP] = batch->longest_steps[number];
    run_set_inputs(run);
    instance_forget_cache(instance);
    state->phase = PHASE_SOLVING_START;
    if (!equations_settle(instance) || !events_refresh(instance, &jumped)) {
        return false;
    }
    massless_keep(state);
    state->phase = PHASE_RUNNING;
    return true;
}

/* Passes knots and samples up to a time (s), the end. */
static bool carry_out(Run *run, double end) {
    const Batch *batch = run->batch;
    const State *state = &run->instance.state;
    while (true) {
        while (run->sample < batch->samples && batch->sample_times[run->sample] <= state->time) {
            if (!run_evaluate(run)) {
                return false;
            }
            store(run, batch->sampled + (run->run * batch->samples + run->sample++) * batch->outputs);
        }
        if (run->knot + 1 < batch->knots && batch->knot_times[run->knot + 1] <= state->time) {
            run->knot++;
            run_set_inputs(run);
            if (!watch_knot(run)) {
                return false;
            }
            continue;
        }
        if (state->time >= end) {
            return true;
        }
        double next = end;
        if (run->sample < batch->samples) {
            next = fmin(next, batch->sample_times[run->sample]);
        }
        if (run->knot + 1 < batch->knots) {
            next = fmin(next, batch->knot_times[run->knot + 1]);
        }
        if (!watch_to(run, next)) {
            return false;
        }
    }
}

/* What a lane that the run has left stored of it. */
static void forget_run(const Batch *batch, int64_t number) {
    for (int64_t i = 0; i < batch->extremes; i++) {
        batch->minima[number * batch->extremes + i] = HUGE_VAL;
        batch->maxima[number * batch->extremes + i] = -HUGE_VAL;
    }
    for (int64_t i = 0; i < batch->crossings; i++) {
        batch->crossing_counts[number * batch->crossings + i] = 0;
    }
}

static bool complete_run(Run *run, int64_t number) {
    const Batch *batch = run->batch;
    forget_run(batch, number);
    if (!begin_scalar_run(run, number) || !run_evaluate(run)) {
        return false;
    }
    watch_start(run);
    if (!carry_out(run, batch->stop_times[number]) || !run_evaluate(run)) {
        return false;
    }
    store(run, batch->finals + number * batch->outputs);
    return true;
}

static void explain(Run *run, int64_t number) {
    char *reason = run->batch->reasons + number * SENTENCE_SIZE;
    explain_failure(&run->instance);
    failure_sentence(&run->instance.failure, reason, SENTENCE_SIZE);
    run->batch->status[number] = RUN_FAILED;
}

EXPORTED int64_t scalar_memory(void) {
    return (int64_t)(64 + arena_bytes(sizeof(Run), 1) + ARENA_HEAD + ARENA_CAPACITY);
}

static Run *run_in(char *memory, const Batch *batch) {
    Run *run = (Run *)(void *)(memory + (64 - (uintptr_t)memory % 64));
    run->batch = batch;
    run->instance.arena = arena_begin((char *)run + arena_bytes(sizeof(Run), 1), ARENA_CAPACITY, ARENA_WORK);
    return run;
}

/* settled[runs][N_STATES]: the start of each run that waits, with what constraints determine. */
EXPORTED void scalar_starts(const Batch *batch, char *memory, double settled[]) {
    Run *run = run_in(memory, batch);
    int64_t number;
    while ((number = __atomic_fetch_add(batch->next, 1, __ATOMIC_RELAXED)) < batch->runs) {
        if (begin_scalar_run(run, number)) {
            memcpy(settled + number * N_STATES, run->instance.state.states, sizeof run->instance.state.states);
        } else {
            batch->status[number] = RUN_LEFT;
        }
    }
    arena_end(run->instance.arena);
}

/* The runs that wait, or that have left their lanes; from any number of threads at once. */
EXPORTED void scalar_runs(const Batch *batch, char *memory) {
    Run *run = run_in(memory, batch);
    int64_t number;
    while ((number = __atomic_fetch_add(batch->next, 1, __ATOMIC_RELAXED)) < batch->runs) {
        if (batch->status[number] == RUN_WAITS || batch->status[number] == RUN_LEFT) {
            if (complete_run(run, number)) {
                batch->status[number] = RUN_DONE;
            } else {
                explain(run, number);
            }
            watch_end(run);
            batch->reached[number] = run->instance.state.time;
            batch->accepted[number] = run->instance.state.steps;
        }
    }
    arena_end(run->instance.arena);
}
