/* The filter goes through the samples in the order of the times to which they belong. Where some are late, the belief
   before the first one that may still come is kept, with all samples and inputs from there on, and each communication
   step goes from it to its own end. So a late sample counts as if it had come in time, for constraints and points too.
   Y. Bar-Shalom, X. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 7.2.4
   (reprocessing). */
#include "observer.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "inputs.h"
#include "kalman.h"
#include "notices.h"
#include "scale.h"
#include "watching.h"

static void gather_estimate(Instance *instance) {
    const State *state = &instance->state;
    double *x = instance->scratch.observer.estimate;
    memcpy(x, state->states, N_STATES * sizeof(double));
    for (int k = 0; k < N_ESTIMATED; k++) {
        x[N_STATES + k] = state->parameters[ESTIMATED[k]];
    }
}

static void keep_estimate(Instance *instance) {
    State *state = &instance->state;
    const double *x = instance->scratch.observer.estimate;
    memcpy(state->states, x, N_STATES * sizeof(double));
    for (int k = 0; k < N_ESTIMATED; k++) {
        state->parameters[ESTIMATED[k]] = x[N_STATES + k];
    }
    instance_forget_cache(instance);
    state->first_stage_valid = 0;
}

/* The present belief becomes that of a time (s). */
static void keep_belief(Instance *instance, double time) {
    ObserverMemory *memory = &instance->state.observer;
    Belief *earlier = &memory->earlier;
    earlier->time = time;
    memcpy(earlier->estimate, instance->scratch.observer.estimate, sizeof earlier->estimate);
    memcpy(earlier->basis, memory->basis, sizeof earlier->basis);
    memcpy(earlier->root, memory->root, sizeof earlier->root);
}

/* The kept belief becomes the present one. Returns its time (s). */
static double recall_belief(Instance *instance) {
    ObserverMemory *memory = &instance->state.observer;
    const Belief *earlier = &memory->earlier;
    memcpy(instance->scratch.observer.estimate, earlier->estimate, sizeof earlier->estimate);
    memcpy(memory->basis, earlier->basis, sizeof earlier->basis);
    memcpy(memory->root, earlier->root, sizeof earlier->root);
    return earlier->time;
}

bool observer_begin(Instance *instance) {
    ObserverMemory *memory = &instance->state.observer;
    const double time = instance->state.time;
    gather_estimate(instance);
    instance->scratch.inputs_move = false;
    if (!kalman_start(instance, time)) {
        return false;
    }
    for (int i = 0; i < N_MEASURED; i++) {
        memory->due[i] = time;
    }
    memory->points = 0;
    keep_belief(instance, time);
    kalman_show(instance);
    return true;
}

/* ---------------------------------------------------------------------------------------------------- the past */

/* The communication point i of those that are kept. */
static CommunicationPoint *point_at(ObserverMemory *memory, int64_t i) {
    return &memory->past[(memory->first + i) % N_PAST];
}

/* s; by which what is measured at a place i is late. */
static double delay_of(const ObserverMemory *memory, int i) {
    return DELAYED ? memory->slots[SLOT_DELAYS + i] : 0.0;
}

static double longest_delay(const ObserverMemory *memory) {
    double longest = 0.0;
    for (int i = 0; i < N_MEASURED; i++) {
        longest = fmax(longest, delay_of(memory, i));
    }
    return longest;
}

/* Notes the present point, with the samples that are due and count. Returns false, with instance->failure, if there is
   no room for it. */
static bool note_point(Instance *instance, double step) {
    State *state = &instance->state;
    ObserverMemory *memory = &state->observer;
    if (memory->points == N_PAST) {
        instance->failure.kind = FAILURE_PAST;
        instance->failure.time = state->time;
        instance->failure.step = longest_delay(memory);
        instance->failure.amount = N_PAST;
        return false;
    }
    CommunicationPoint *point = point_at(memory, memory->points++);
    point->time = state->time;
    point->inputs_move = instance->scratch.inputs_move;
    memcpy(point->inputs, state->inputs, sizeof point->inputs);
    for (int i = 0; i < N_MEASURED; i++) {
        const double between = memory->slots[SLOT_SAMPLE_TIMES + i];
        const bool due = between <= 0.0 || state->time >= memory->due[i] - COMMUNICATION_POINT * step;
        if (due && between > 0.0) {
            const double passed = floor((state->time + COMMUNICATION_POINT * step - memory->due[i]) / between);
            memory->due[i] += (passed + 1.0) * between;
        }
        point->samples[i] = memory->slots[SLOT_SAMPLES + i];
        point->counts[i] = due && memory->slots[SLOT_COUNTS + i] >= 0.5;
    }
    memset(memory->slots + SLOT_INNOVATIONS, 0, (size_t)(N_OBSERVER_SLOTS - SLOT_INNOVATIONS) * sizeof(double));
    return true;
}

/* Forgets the points behind which another one is not later than the kept belief. */
static void forget_points(ObserverMemory *memory, double near) {
    while (memory->points > 1 && point_at(memory, 1)->time <= memory->earlier.time + near) {
        memory->first = (memory->first + 1) % N_PAST;
        memory->points--;
    }
}

/* The inputs of the last point that is not later than a time (s). */
static void recall_inputs(Instance *instance, double time) {
    ObserverMemory *memory = &instance->state.observer;
    int64_t i = memory->points - 1;
    while (i > 0 && point_at(memory, i)->time > time) {
        i--;
    }
    const CommunicationPoint *point = point_at(memory, i);
    memcpy(instance->state.inputs, point->inputs, sizeof point->inputs);
    instance->scratch.inputs_move = point->inputs_move != 0;
    instance->scratch.step_start = point->time;
}

/* What was measured at a time (s), apart from it by no more than near; from the present point it is fresh. */
static void gather_sample(ObserverMemory *memory, double time, double near, Sample *sample) {
    sample->old = sample->fresh = 0;
    for (int64_t j = 0; j < memory->points; j++) {
        const CommunicationPoint *point = point_at(memory, j);
        for (int i = 0; i < N_MEASURED; i++) {
            if (point->counts[i] && fabs(point->time - delay_of(memory, i) - time) <= near) {
                sample->taken[sample->old + sample->fresh] = i;
                sample->measured[i] = point->samples[i];
                *(j + 1 < memory->points ? &sample->old : &sample->fresh) += 1;
            }
        }
    }
}

/* The next time (s) at which inputs or samples come, at most the end. */
static double next_time(ObserverMemory *memory, double time, double near, double end) {
    double next = end;
    for (int64_t j = 0; j < memory->points; j++) {
        const CommunicationPoint *point = point_at(memory, j);
        next = point->time > time + near ? fmin(next, point->time) : next;
        for (int i = 0; i < N_MEASURED; i++) {
            const double belongs = point->time - delay_of(memory, i);
            next = point->counts[i] && belongs > time + near ? fmin(next, belongs) : next;
        }
    }
    return next < end - near ? next : end;
}

/* ---------------------------------------------------------------------------------------------------- a step */

/* Is the step (s) no longer than the time between samples? */
static bool samples_fit(Instance *instance, double step) {
    for (int i = 0; i < N_MEASURED; i++) {
        const double between = instance->state.observer.slots[SLOT_SAMPLE_TIMES + i];
        if (between > 0.0 && step > between * (1.0 + COMMUNICATION_POINT)) {
            instance->failure.kind = FAILURE_SAMPLE_TIME;
            instance->failure.time = instance->state.time;
            instance->failure.step = step;
            instance->failure.amount = between;
            return false;
        }
    }
    return true;
}

/* From the kept belief to the end (s), by all that is known of the time between. */
static bool estimate_to(Instance *instance, double end) {
    ObserverMemory *memory = &instance->state.observer;
    const double longest = longest_delay(memory), near = INSTANT * longest;
    Sample sample;
    double time = recall_belief(instance);
    for (;;) {
        if (time <= end - longest + near / 2.0) {
            keep_belief(instance, time); /* before its samples, as one may still come that belongs here */
        }
        if (time >= end) {
            forget_points(memory, near);
            return true;
        }
        recall_inputs(instance, time + near);
        gather_sample(memory, time, near, &sample);
        const double next = next_time(memory, time, near, end);
        if ((sample.old + sample.fresh > 0 && !kalman_correct(instance, time, &sample)) ||
            !kalman_predict(instance, time, next)) {
            return false;
        }
        time = next;
    }
}

bool observer_advance(Instance *instance, double end) {
    State *state = &instance->state;
    ObserverMemory *before = &instance->scratch.observer.before;
    const size_t changing = offsetof(ObserverMemory, past); /* a point that is kept stands behind those before */
    memcpy(before, &state->observer, changing);
    instance->failure.kind = FAILURE_NONE;
    begin_notices(instance);
    inputs_begin(instance);
    const double step = end - state->time;
    const bool noted = samples_fit(instance, step) && note_point(instance, step);
    const bool found = noted && estimate_to(instance, end);
    if (noted) {
        recall_inputs(instance, end); /* the present ones */
    }
    if (found) {
        state->time = end;
        keep_estimate(instance);
        kalman_show(instance);
    } else {
        memcpy(&state->observer, before, changing);
    }
    inputs_end(instance);
    keep_motions(state);
    return found;
}
