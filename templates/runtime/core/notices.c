/* Looking for what the importer should know. The stiffness test: Hairer, Wanner, Solving Ordinary Differential
   Equations II, 2nd edition, section IV.2. */
#include "notices.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "events.h"
#include "names.h"

static const double SAME_LENGTH = 1e-6;    /* importers' rounding may change the lengths of steps by this part */
static const int64_t LOOK = 100;           /* while none is suspected, stiffness is looked for every so many steps */
static const double AT_THE_LIMIT = 0.98;   /* a step of this part of what stability allows is at the limit; the value
                                              of Hairer and Wanner's codes */
static const int64_t CONVINCED = 15;       /* so many steps at the limit show stiffness; value of the same codes */
static const int64_t CLEARED = 6;          /* so many easy steps in a row end the suspicion; value of the same codes */

static const int64_t LONE_MOVES = 3;       /* so many steps that move the position of a motion alone give notice */

enum { VIBRATIONS_SHOWN = 3 }; /* the sentence names the fastest ones that are not resolved */

/* The longest step (s) that resolves a vibration (rad/s): an eighth of its period, by which ros2 takes 1 % from it in a
   period and radau5 0.03 %. */
static double resolving_step(double frequency) {
    return 0.25 * 3.141592653589793 / frequency;
}

double rounding_of_length(double time) {
    return 4.0 * DBL_EPSILON * fabs(time);
}

void begin_notices(Instance *instance) {
    instance->n_notices = 0;
}

static void add_notice(Instance *instance, NoticeKind kind, double step, int index) {
    if (instance->n_notices < MOST_NOTICES) {
        instance->notices[instance->n_notices++] = (Notice){kind, instance->state.time, step, index};
    }
}

/* Keeps a notice, which is told once, at the end of the importer's step. */
static void give_notice(Instance *instance, NoticeKind kind, double step, int index) {
    if ((instance->state.noticed & (int64_t)kind) == 0) {
        instance->state.noticed |= (int64_t)kind;
        add_notice(instance, kind, step, index);
    }
}

void watch_stiffness(Instance *instance, Step step) {
    State *state = &instance->state;
    const bool looks = ++state->steps % LOOK == 0 || (METHOD.error_order == 0 && state->steps < LOOK);
    if ((state->noticed & NOTICE_STIFF) != 0 || (state->stiff_steps == 0 && !looks)) {
        return;
    }
    if (solver_stiffness(instance) > AT_THE_LIMIT) {
        state->easy_steps = 0;
        if (++state->stiff_steps >= CONVINCED) {
            give_notice(instance, NOTICE_STIFF, step.length, 0);
        }
    } else if (state->stiff_steps > 0 && ++state->easy_steps == CLEARED) {
        state->stiff_steps = state->easy_steps = 0;
    }
}

void watch_length(Instance *instance, double length) {
    State *state = &instance->state;
    const double tolerance = SAME_LENGTH * length + rounding_of_length(state->time);
    if (length <= SAME_LENGTH * state->equal_step) {
        return; /* what an importer's rounding left over */
    }
    if (state->equal_step > 0.0 && fabs(length - state->equal_step) > tolerance) {
        give_notice(instance, NOTICE_UNEQUAL, length, 0);
    }
    state->equal_step = length;
}

void watch_vibrations(Instance *instance, double length) {
    enum { FIRST = N_MASKS + N_SWITCHES }; /* behind the modes */
    const double *parameters = instance->state.parameters + FIRST;
    if (N_VIBRATIONS > 0 && length > resolving_step(VIBRATIONS[0]) &&
        memcmp(parameters, START_PARAMETERS + FIRST, (SIZE_PARAMETERS - FIRST) * sizeof(double)) == 0) {
        give_notice(instance, NOTICE_UNRESOLVED, length, 0);
    }
}

/* Does this motion have a velocity or an acceleration now, as inputs or by their derivatives? */
static bool is_led(State *state, int input) {
    const double *first = input_derivatives(state, 1);
    return state->inputs[input + 1] != 0.0 || state->inputs[input + 2] != 0.0 || first[input + 1] != 0.0 ||
           first[input + 2] != 0.0;
}

void watch_motions(Instance *instance) {
    State *state = &instance->state;
    int lone = -1;
    for (int k = 0; k < N_MOTIONS; k++) {
        const int input = FIRST_MOTION + 3 * k;
        const bool moves = state->inputs[input] != state->positions[k] || input_derivatives(state, 1)[input] != 0.0;
        lone = MOTION_RATES[k] && moves && !is_led(state, input) ? k : lone;
    }
    if (lone >= 0 && state->time > state->start_time && ++state->lone_moves >= LONE_MOVES) {
        give_notice(instance, NOTICE_MOTION, 0.0, lone);
    }
}

void keep_motions(State *state) {
    for (int k = 0; k < N_MOTIONS; k++) {
        state->positions[k] = state->inputs[FIRST_MOTION + 3 * k];
    }
}

void watch_ranges(Instance *instance) {
    State *state = &instance->state;
    for (int k = 0; k < N_BOUNDED; k++) {
        const double q = state->states[BOUNDED[k]];
        if (!state->left_range[k] && (q < RANGES[k][0] || q > RANGES[k][1])) {
            state->left_range[k] = 1;
            add_notice(instance, NOTICE_RANGE, 0.0, k);
        }
    }
}

/* Names the vibrations that are faster than steps of this length resolve, and says how to keep them. */
static void vibrations_sentence(const Notice *notice, char text[], size_t size) {
    char list[400] = "";
    size_t used = 0;
    int count = 0;
    for (; count < N_VIBRATIONS && notice->step > resolving_step(VIBRATIONS[count]); count++) {
        if (count < VIBRATIONS_SHOWN && used < sizeof list) {
            const int written = snprintf(list + used, sizeof list - used, "%s%.3g rad/s (%.80s)", count > 0 ? ", " : "",
                                         VIBRATIONS[count], COORDINATE_NAMES[VIBRATING[count]]);
            used += written > 0 ? (size_t)written : 0;
        }
    }
    if (count > VIBRATIONS_SHOWN && used < sizeof list) {
        snprintf(list + used, sizeof list - used, " and %d slower ones", count - VIBRATIONS_SHOWN);
    }
    const double enough = 0.4 * resolving_step(VIBRATIONS[0]);
    if (METHOD.damps) {
        snprintf(text, size, "solver %s damps undamped vibrations at time %.17g s, where its step of %.3g s is longer "
                 "than an eighth of a period: %s; if they matter, set solver_max_step to %.2g s", METHOD.name,
                 notice->time, notice->step, list, enough);
    } else {
        snprintf(text, size, "solver %s gets vibrations wrong, or is unstable, at time %.17g s, where its step of %.3g "
                 "s is longer than an eighth of a period: %s; set solver_step to %.2g s, or export with --solver "
                 "dopri5", METHOD.name, notice->time, notice->step, list, enough);
    }
}

static void motion_sentence(const Notice *notice, char text[], size_t size) {
    const int input = FIRST_MOTION + 3 * notice->index;
    snprintf(text, size, "the input %s moves at time %.17g s, but %s and %s stay 0: the equations take the support as "
             "resting; connect all three, or set derivatives for all three", variable_name(VARIABLE_INPUT, input),
             notice->time, variable_name(VARIABLE_INPUT, input + 1), variable_name(VARIABLE_INPUT, input + 2));
}

void note_impact(Instance *instance, NoticeKind kind, int event) {
    give_notice(instance, kind, 0.0, event);
}

static void impact_sentence(const Notice *notice, char text[], size_t size) {
    const char *name = events_name(notice->index);
    if (notice->kind == NOTICE_NO_FORCES) {
        snprintf(text, size, "at time %.17g s sliding friction left no forces that obey their laws (Painleve's "
                 "paradox; %.400s): an impact without a collision stopped the slip; check the coefficient of friction",
                 notice->time, name);
    } else if (notice->kind == NOTICE_TWO_SOLUTIONS) {
        snprintf(text, size, "at time %.17g s sliding friction allows two motions (Painleve's paradox; %.400s): the "
                 "present mode goes on; check the coefficient of friction", notice->time, name);
    } else if (notice->kind == NOTICE_POISSON) {
        snprintf(text, size, "at time %.17g s Newton's law of impact would have made the kinetic energy grow, or had "
                 "no solution (%.400s): Poisson's law was taken there; lower the restitution or the friction if that "
                 "is not meant", notice->time, name);
    } else if (notice->kind == NOTICE_REDUCED) {
        snprintf(text, size, "at time %.17g s Newton's law of impact would have made the kinetic energy grow (%.400s): "
                 "the restitution was reduced there; lower the restitution or the friction if that is not meant",
                 notice->time, name);
    } else {
        snprintf(text, size, "at time %.17g s the rounds of an impact had no end (%.400s): it was closed without "
                 "restitution; export with impacts = \"simultaneous\" if the contacts share it", notice->time, name);
    }
}

void notice_sentence(const Notice *notice, char text[], size_t size) {
    switch (notice->kind) {
    case NOTICE_STIFF:
        solver_stiffness_sentence(notice, text, size);
        break;
    case NOTICE_UNEQUAL:
        snprintf(text, size, "the solver step changed to %.17g s at time %.17g s; solver %s keeps the energy bounded "
                 "over long times with equal steps only: keep the communication steps equal", notice->step,
                 notice->time, METHOD.name);
        break;
    case NOTICE_UNRESOLVED:
        vibrations_sentence(notice, text, size);
        break;
    case NOTICE_MOTION:
        motion_sentence(notice, text, size);
        break;
    case NOTICE_RANGE:
        snprintf(text, size, "the coordinate %s leaves its range from %.6g to %.6g (SI) before time %.17g s; the "
                 "bounds are no stops, and the motion goes on without them", state_name(BOUNDED[notice->index]),
                 RANGES[notice->index][0], RANGES[notice->index][1], notice->time);
        break;
    case NOTICE_NO_FORCES:
    case NOTICE_TWO_SOLUTIONS:
    case NOTICE_POISSON:
    case NOTICE_CLOSED:
    case NOTICE_REDUCED:
        impact_sentence(notice, text, size);
        break;
    case NOTICE_NONE:
    default:
        snprintf(text, size, "nothing was noticed");
        break;
    }
}
