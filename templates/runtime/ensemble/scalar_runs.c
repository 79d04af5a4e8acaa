/* Runs of a batch one by one, by the very runtime of the FMU: the runs that cannot go in lanes, and all starts that
   constraints determine. */
#include <math.h>
#include <string.h>

#include "diagnosis.h"
#include "equations.h"
#include "failure.h"
#include "inputs.h"
#include "integrator.h"
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

static void hear(void *owner, const char sentence[]) {
    (void)owner;
    (void)sentence;
}

/* All quantities at the present point. */
bool run_evaluate(Run *run) {
    Instance *instance = &run->instance;
    double *values = run->quantities;
    if (!integrator_catch_up(instance) || !equations_locals(instance)) {
        return false;
    }
    memcpy(values, instance->state.states, sizeof instance->state.states);
    memcpy(values + AT_UNKNOWNS, instance->cache.shown, sizeof instance->cache.shown);
    memcpy(values + AT_FURTHER_RATES, instance->cache.further, N_FURTHER * sizeof(double));
    memcpy(values + AT_LOCALS, instance->cache.locals, N_LOCALS * sizeof(double));
    memcpy(values + AT_INPUTS, instance->state.inputs, N_INPUTS * sizeof(double));
    return true;
}

static void store(const Run *run, double place[]) {
    const Batch *batch = run->batch;
    for (int64_t i = 0; i < batch->outputs; i++) {
        place[i] = run->quantities[batch->output_columns[i]];
    }
}

/* The inputs from the present knot on, as polynomials of first order. */
static void set_inputs(Run *run) {
    const Batch *batch = run->batch;
    State *state = &run->instance.state;
    const int64_t first = (batch->inputs_apart ? run->run * batch->knots : 0) + run->knot;
    const double *from = batch->inputs + first * N_INPUTS;
    const bool moves = run->knot + 1 < batch->knots && !batch->hold;
    const double here = batch->knot_times[run->knot];
    const double span = moves ? batch->knot_times[run->knot + 1] - here : 1.0;
    for (int i = 0; i < N_INPUTS; i++) {
        const double slope = moves ? (from[N_INPUTS + i] - from[i]) / span : 0.0;
        instance_assign(&run->instance, &state->inputs[i], from[i] + slope * (state->time - here));
        if (moves) {
            inputs_set_derivative(&run->instance, i, 1, slope);
        }
    }
}

/* Starts a run, up to what follows from its start values. */
static bool begin(Run *run, int64_t number) {
    const Batch *batch = run->batch;
    Instance *instance = &run->instance;
    State *state = &instance->state;
    bool jumped;
    memset(instance, 0, sizeof *instance);
    instance->policy = &OWN_SOLVER;
    instance->listener.hear = hear;
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
    set_inputs(run);
    instance_forget_cache(instance);
    state->phase = PHASE_SOLVING_START;
    if (!equations_settle(instance) || !events_refresh(instance, &jumped)) {
        return false;
    }
    massless_keep(state);
    state->phase = PHASE_RUNNING;
    return true;
}

/* Integrates to a time (s), which no sample and no knot stand before. The slopes of inputs hold for one communication
   step, and are set for each. */
bool run_advance(Run *run, double time) {
    if (!(time > run->instance.state.time)) {
        return true;
    }
    if (batch_stopped(run->batch)) {
        return false;
    }
    if (run->knot + 1 < run->batch->knots) {
        set_inputs(run);
    }
    return integrate(&run->instance, time);
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
            set_inputs(run);
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
static void forget(const Batch *batch, int64_t number) {
    for (int64_t i = 0; i < batch->extremes; i++) {
        batch->minima[number * batch->extremes + i] = HUGE_VAL;
        batch->maxima[number * batch->extremes + i] = -HUGE_VAL;
    }
    for (int64_t i = 0; i < batch->crossings; i++) {
        batch->crossing_counts[number * batch->crossings + i] = 0;
    }
}

static bool complete(Run *run, int64_t number) {
    const Batch *batch = run->batch;
    forget(batch, number);
    if (!begin(run, number) || !run_evaluate(run)) {
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
    return (int64_t)sizeof(Run) + 64;
}

static Run *run_in(char *memory, const Batch *batch) {
    Run *run = (Run *)(void *)(memory + (64 - (uintptr_t)memory % 64));
    run->batch = batch;
    return run;
}

/* settled[runs][N_STATES]: the start of each run that waits, with what constraints determine. */
EXPORTED void scalar_starts(const Batch *batch, char *memory, double settled[]) {
    Run *run = run_in(memory, batch);
    int64_t number;
    while ((number = __atomic_fetch_add(batch->next, 1, __ATOMIC_RELAXED)) < batch->runs) {
        if (begin(run, number)) {
            memcpy(settled + number * N_STATES, run->instance.state.states, sizeof run->instance.state.states);
        } else {
            batch->status[number] = RUN_LEFT;
        }
    }
}

/* The runs that wait, or that have left their lanes; from any number of threads at once. */
EXPORTED void scalar_runs(const Batch *batch, char *memory) {
    Run *run = run_in(memory, batch);
    int64_t number;
    while ((number = __atomic_fetch_add(batch->next, 1, __ATOMIC_RELAXED)) < batch->runs) {
        if (batch->status[number] == RUN_WAITS || batch->status[number] == RUN_LEFT) {
            if (complete(run, number)) {
                batch->status[number] = RUN_DONE;
            } else {
                explain(run, number);
            }
            watch_end(run);
            batch->reached[number] = run->instance.state.time;
            batch->accepted[number] = run->instance.state.steps;
        }
    }
}
