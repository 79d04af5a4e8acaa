/* What is watched of a run beside its samples: extremes, zeros of quantities, events. Extremes and zeros are looked for
   in parts of the run that take no more than a few solver steps. */
#include <math.h>
#include <string.h>

#include "integrator.h"
#include "scalar_run.h"
#include "scale.h"

enum {
    WATCHED_PARTS = 400, /* of a run, at least */
    STEPS_IN_A_PART = 2,
    ZERO_BISECTIONS = 50,
    SECTIONS = 40 /* of an interval in which a quantity may touch 0 */
};

/* (3 - sqrt 5)/2: where a golden section divides an interval. */
static const double GOLDEN = 0.3819660112501051;

static void keep_point(const Run *run, Point *point) {
    point->state = run->instance.state;
    point->noted = run->noted;
    memcpy(point->quantities, run->quantities, sizeof run->quantities);
}

static void go_back(Run *run, const Point *point) {
    run->instance.state = point->state;
    run->noted = point->noted;
    memcpy(run->quantities, point->quantities, sizeof run->quantities);
    instance_forget_cache(&run->instance);
    run->instance.cache.states_behind = false;
}

static void widen(const Run *run) {
    const Batch *batch = run->batch;
    for (int64_t i = 0; i < batch->extremes; i++) {
        const double value = run->quantities[batch->extreme_columns[i]];
        double *least = &batch->minima[run->run * batch->extremes + i];
        double *greatest = &batch->maxima[run->run * batch->extremes + i];
        *least = value < *least ? value : *least;
        *greatest = value > *greatest ? value : *greatest;
    }
}

/* Notes that an event came at a time (s), if it was asked for and was not noted at that very time. */
static void note_event(Run *run, int kind, double time) {
    const Batch *batch = run->batch;
    int64_t *count = &run->noted.counts[kind];
    bool again = false;
    for (int64_t i = 0; i < batch->events; i++) {
        double *times = batch->event_times + (run->run * batch->events + i) * batch->most_events;
        if (batch->event_kinds[i] == kind) {
            again = *count > 0 && *count <= batch->most_events && times[*count - 1] == time;
            if (!again && *count < batch->most_events) {
                times[*count] = time;
            }
        }
    }
    *count += again ? 0 : 1;
}

/* Notes the events that were passed since the last time, and which one comes next. */
static void note_events(Run *run) {
    const State *state = &run->instance.state;
    Noted *noted = &run->noted;
    const bool passed = state->event_time != noted->time || state->events_there != noted->there;
    for (int k = 0; k < N_EVENTS && passed; k++) {
        if (noted->pending ? noted->due[k] : state->due[k]) {
            note_event(run, k, state->event_time);
        }
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (state->impacts[i] > noted->impacts[i]) {
            note_event(run, N_EVENTS + i, passed ? state->event_time : state->time);
        }
    }
    noted->passed += passed;
    noted->time = state->event_time;
    noted->there = state->events_there;
    noted->pending = state->event_pending;
    memcpy(noted->due, state->due, sizeof noted->due);
    memcpy(noted->impacts, state->impacts, sizeof noted->impacts);
}

/* The end of a solver step, at which an event and a kink of the motion may be. */
static double follow(void *owner, double end) {
    Run *run = owner;
    const ArenaMark mark = arena_mark(run->instance.arena);
    WORK(mark, double, quantities, N_QUANTITIES);
    note_events(run);
    if (run->batch->extremes > 0) {
        memcpy(quantities, run->quantities, N_QUANTITIES * sizeof(double));
        if (run_evaluate(run)) {
            widen(run);
        }
        memcpy(run->quantities, quantities, N_QUANTITIES * sizeof(double));
    }
    arena_release(mark);
    return end;
}

/* The value of a quantity at a time (s) behind a point. */
static bool quantity_at(Run *run, const Point *from, double time, int64_t column, double *value) {
    go_back(run, from);
    if (!run_advance(run, time) || !run_evaluate(run)) {
        return false;
    }
    *value = run->quantities[column];
    return true;
}

/* The time at which a quantity changes its sign between a point and a time (s). */
static double locate_zero(Run *run, const Point *from, double time, int64_t column) {
    double left = from->state.time, right = time, value;
    const bool negative = from->quantities[column] < 0.0;
    for (int i = 0; i < ZERO_BISECTIONS && right - left > NOISE * fabs(right); i++) {
        const double middle = 0.5 * (left + right);
        if (!quantity_at(run, from, middle, column, &value)) {
            break;
        }
        *((value < 0.0) == negative ? &left : &right) = middle;
    }
    return right;
}

static void note_crossing(const Run *run, int64_t crossing, double time) {
    const Batch *batch = run->batch;
    const int64_t place = run->run * batch->crossings + crossing;
    const int64_t count = batch->crossing_counts[place]++;
    if (count < batch->most_crossings) {
        batch->crossed[place * batch->most_crossings + count] = time;
    }
}

/* May a quantity whose distances from 0 at three times (s) are these come to 0 in between? The parabola through the
   three comes near. */
static bool may_touch(const double times[3], const double distances[3]) {
    const double a = distances[0], b = distances[1], c = distances[2];
    const double left = (b - a) / (times[1] - times[0]), right = (c - b) / (times[2] - times[1]);
    const double bend = (right - left) / (times[2] - times[0]);
    const double slope = left + bend * (times[1] - times[0]);
    return b <= a && b <= c && bend > 0.0 && b - 0.25 * slope * slope / bend <= 0.25 * b;
}

/* Looks for a time (s) at which a quantity that has one sign at the last three points has the other one, by golden
   sections of the interval where its distance from 0 is least. */
static bool find_other_sign(Run *run, int64_t column, double *time) {
    const double sign = run->earlier.quantities[column] < 0.0 ? -1.0 : 1.0;
    const double noise = MET * fmax(fabs(run->earlier.quantities[column]), fabs(run->present.quantities[column]));
    double left = run->earlier.state.time, right = run->present.state.time;
    double best = run->before.state.time, least = sign * run->before.quantities[column], value;
    for (int i = 0; i < SECTIONS && least >= -noise; i++) {
        const bool longer_left = best - left > right - best;
        *time = longer_left ? best - GOLDEN * (best - left) : best + GOLDEN * (right - best);
        if (!quantity_at(run, &run->earlier, *time, column, &value)) {
            return false;
        }
        if (sign * value < least) {
            *(longer_left ? &right : &left) = best;
            best = *time;
            least = sign * value;
        } else {
            *(longer_left ? &left : &right) = *time;
        }
    }
    *time = best;
    return least < -noise;
}

/* Two zeros between the last three points, at which the quantity has one sign. */
static void watch_touch(Run *run, int64_t crossing) {
    const int64_t column = run->batch->crossing_columns[crossing];
    const double values[3] = {run->earlier.quantities[column], run->before.quantities[column],
                              run->present.quantities[column]};
    const double times[3] = {run->earlier.state.time, run->before.state.time, run->present.state.time};
    const double distances[3] = {fabs(values[0]), fabs(values[1]), fabs(values[2])};
    const bool one_sign = (values[0] < 0.0) == (values[1] < 0.0) && (values[1] < 0.0) == (values[2] < 0.0);
    double between, value;
    if (one_sign && may_touch(times, distances) && find_other_sign(run, column, &between)) {
        note_crossing(run, crossing, locate_zero(run, &run->earlier, between, column));
        if (quantity_at(run, &run->earlier, between, column, &value)) {
            keep_point(run, &run->between);
            note_crossing(run, crossing, locate_zero(run, &run->between, times[2], column));
        }
    }
}

static void watch_crossings(Run *run) {
    const Batch *batch = run->batch;
    const Listener listener = run->instance.listener;
    run->instance.listener.follow = NULL; /* what is gone through again was noted */
    for (int64_t i = 0; i < batch->crossings; i++) {
        const int64_t column = batch->crossing_columns[i];
        const double from = run->before.quantities[column], to = run->present.quantities[column];
        const bool begins_there = from == 0.0 && run->before.state.time == batch->start_time;
        if ((from < 0.0) != (to < 0.0) && !begins_there) {
            note_crossing(run, i, locate_zero(run, &run->before, run->present.state.time, column));
        } else if (run->points > 1) {
            watch_touch(run, i);
        }
    }
    run->instance.listener = listener;
}

/* Extremes at the present point, and at the vertex of the parabola through the last three, if no event was among
   them. */
static void watch_extremes(Run *run) {
    const ArenaMark mark = arena_mark(run->instance.arena);
    WORK(mark, double, quantities, N_QUANTITIES);
    const Batch *batch = run->batch;
    const Point *a = &run->earlier, *b = &run->before, *c = &run->present;
    widen(run);
    if (run->points < 2 || a->noted.passed != c->noted.passed) {
        arena_release(mark);
        return;
    }
    memcpy(quantities, run->quantities, N_QUANTITIES * sizeof(double));
    for (int64_t i = 0; i < batch->extremes; i++) {
        const int64_t column = batch->extreme_columns[i];
        const double first = b->state.time - a->state.time, second = c->state.time - b->state.time;
        const double left = (b->quantities[column] - a->quantities[column]) / first;
        const double right = (c->quantities[column] - b->quantities[column]) / second;
        const double bend = (right - left) / (first + second), slope = left + bend * first;
        if (left * right < 0.0) {
            run->quantities[column] = b->quantities[column] - 0.25 * slope * slope / bend;
        }
    }
    widen(run);
    memcpy(run->quantities, quantities, N_QUANTITIES * sizeof(double));
    arena_release(mark);
}

/* One part up to a time (s), no longer than *length, which follows the solver's steps. A part with many of them is
   taken back and becomes shorter. */
static bool watch_part(Run *run, double time, double shortest, double *length) {
    State *state = &run->instance.state;
    const double begin = state->time;
    const int64_t steps = state->steps;
    const bool last = time - begin <= 1.001 * *length;
    if (!integrator_catch_up(&run->instance)) {
        return false;
    }
    keep_point(run, &run->present);
    if (!run_advance(run, last ? time : begin + *length)) {
        return false;
    }
    const int64_t taken = state->steps - steps;
    if (ADAPTIVE && taken > STEPS_IN_A_PART && *length > shortest) {
        go_back(run, &run->present);
        *length = 0.5 * fmin(*length, time - begin);
        return true;
    }
    *length *= taken < STEPS_IN_A_PART ? 2.0 : 1.0;
    run->earlier = run->before;
    run->before = run->present;
    run->points += 1;
    note_events(run);
    if (!run_evaluate(run)) {
        return false;
    }
    keep_point(run, &run->present);
    watch_extremes(run);
    watch_crossings(run);
    go_back(run, &run->present);
    return true;
}

/* The longest part on the way to a time (s): of methods of fixed step it is one of the equal steps. */
static double longest_part(const Run *run, double time) {
    const Batch *batch = run->batch;
    const double way = time - run->instance.state.time;
    if (ADAPTIVE) {
        return (batch->stop_times[run->run] - batch->start_time) / (double)WATCHED_PARTS;
    }
    return way / fmax(1.0, ceil(way / batch->steps[run->run] * (1.0 - INSTANT)));
}

bool watch_to(Run *run, double time) {
    const Batch *batch = run->batch;
    const double shortest = INSTANT * (batch->stop_times[run->run] - batch->start_time);
    const double longest = longest_part(run, time);
    double length = longest;
    if (batch->extremes + batch->crossings == 0) {
        return run_advance(run, time);
    }
    while (run->instance.state.time < time) {
        if (!watch_part(run, time, shortest, &length)) {
            return false;
        }
        length = fmin(length, longest);
    }
    return true;
}

bool watch_knot(Run *run) {
    const ArenaMark mark = arena_mark(run->instance.arena);
    WORK(mark, double, before, N_QUANTITIES);
    const Batch *batch = run->batch;
    if (batch->extremes + batch->crossings == 0) {
        return arena_leave(mark, true);
    }
    memcpy(before, run->quantities, N_QUANTITIES * sizeof(double));
    if (!run_evaluate(run)) {
        return arena_leave(mark, false);
    }
    for (int64_t i = 0; i < batch->crossings; i++) {
        const int64_t column = batch->crossing_columns[i];
        if ((before[column] < 0.0) != (run->quantities[column] < 0.0)) {
            note_crossing(run, i, run->instance.state.time);
        }
    }
    widen(run);
    run->points = 0;
    return arena_leave(mark, true);
}

void watch_start(Run *run) {
    memset(&run->noted, 0, sizeof run->noted);
    run->noted.time = run->instance.state.event_time;
    run->noted.there = run->instance.state.events_there;
    run->points = 0;
    note_events(run);
    widen(run);
    if (run->batch->extremes + run->batch->events > 0) {
        run->instance.listener.follow = follow;
        run->instance.listener.owner = run;
    }
}

void watch_end(Run *run) {
    const Batch *batch = run->batch;
    note_events(run);
    for (int64_t i = 0; i < batch->events; i++) {
        batch->event_counts[run->run * batch->events + i] = run->noted.counts[batch->event_kinds[i]];
    }
}
