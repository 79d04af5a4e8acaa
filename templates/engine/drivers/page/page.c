#include "page.h"

#include <math.h>
#include <string.h>

#include "arena_size.h"
#include "diagnosis.h"
#include "equations.h"
#include "events.h"
#include "failure_sentence.h"
#include "integrator.h"
#include "massless.h"
#include "picture.h"
#include "values.h"
#include "work.h"

/* A page has one instance, so it is static; an FMU may have many. */
static Instance the_instance;
static double the_work[(ARENA_HEAD + ARENA_CAPACITY) / sizeof(double) + 1];
static struct {
    double states[N_STATES];
    double inputs[N_SIGNALS];
    double parameters[SIZE_PARAMETERS];
} the_point;
static double the_values[N_VARIABLES];
static double the_power[SIZE_WORK];
static double the_picture[SIZE_PICTURE];
static char the_sentence[SENTENCE_SIZE];

/* Notes in words why a call failed; returns 0. */
static int failed(void) {
    failure_sentence(&the_instance.failure, the_sentence, sizeof the_sentence);
    return 0;
}

const int *page_sizes(void) {
    static const int SIZES[] = {N_STATES,    N_SIGNALS,    SIZE_PARAMETERS,  N_COORDINATES,
                                N_VARIABLES, SIZE_PICTURE, (int)sizeof(State)};
    return SIZES;
}

void page_begin(double start, double stop, double tolerance) {
    State *state = &the_instance.state;
    the_instance.policy = &OWN_SOLVER;
    the_instance.listener.awaits_events = true;
    arena_end(the_instance.arena);
    instance_work_in(&the_instance, arena_begin(the_work, ARENA_CAPACITY, ARENA_WORK));
    instance_start(&the_instance);
    state->time = state->start_time = start;
    state->stop_time_defined = 1;
    state->stop_time = stop;
    state->tolerance = tolerance;
    the_sentence[0] = '\0';
}

void page_set(int variable, double value) {
    if (integrator_catch_up(&the_instance)) {
        instance_assign(&the_instance, value_slot(&the_instance, &VARIABLES[variable]), value);
    }
}

int page_settle(void) {
    bool jumped;
    the_instance.state.phase = PHASE_SOLVING_START;
    if (!equations_settle(&the_instance) || !events_refresh(&the_instance, &jumped)) {
        return failed();
    }
    massless_keep(&the_instance.state);
    the_instance.state.phase = PHASE_RUNNING;
    return 1;
}

int page_advance(double end) {
    if (integrator_pass(&the_instance, end)) {
        return 1;
    }
    if (!integrate(&the_instance, end)) {
        explain_failure(&the_instance);
        return failed();
    }
    return the_instance.state.event_held ? 2 : 1;
}

int page_pass(void) {
    if (!integrator_settle(&the_instance)) {
        explain_failure(&the_instance);
        return failed();
    }
    return 1;
}

double page_time(void) {
    return the_instance.state.time;
}

/* The value of a variable, not a number where it has none. */
static double value_of(const Variable *variable) {
    if (value_is_integer(variable->kind)) {
        return value_integer(&the_instance, variable);
    }
    if (!value_is_real(variable->kind) || !value_update(&the_instance, variable->kind)) {
        return (double)NAN;
    }
    return *value_slot(&the_instance, variable);
}

void page_observe(void) {
    const State *state = &the_instance.state;
    (void)integrator_catch_up(&the_instance);
    for (int i = 0; i < N_VARIABLES; i++) {
        the_values[i] = value_of(&VARIABLES[i]);
    }
    memcpy(the_point.states, state->states, sizeof the_point.states);
    memcpy(the_point.inputs, state->inputs, sizeof the_point.inputs);
    memcpy(the_point.parameters, state->parameters, sizeof the_point.parameters);
}

const double *page_power(void) {
    work_power(the_instance.state.time, the_values, the_power);
    return the_power;
}

double *page_point(void) {
    return the_point.states;
}

const double *page_values(void) {
    return the_values;
}

const double *page_draw(double time) {
    picture_spots(time, the_point.states, the_point.inputs, the_point.parameters, the_picture);
    return the_picture;
}

void *page_state(void) {
    return &the_instance.state;
}

void page_restored(void) {
    instance_forget_cache(&the_instance);
}

const char *page_sentence(void) {
    return the_sentence;
}
