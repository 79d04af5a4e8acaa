/* Newton's method for the positions, of which there are few; the velocities then follow from linear equations. */
#include "massless.h"

#include <math.h>
#include <string.h>

#include "failure.h"
#include "finite.h"
#include "lu.h"
#include "scale.h"

/* Bounds: of Newton steps, and of lengths of one step that are tried, each half of the one before. */
enum { MOST_MASSLESS_ITERATIONS = 50, MOST_LENGTHS = 13 };

static const double REST[N_MASSLESS] = {0.0};

/* The constraints at some states. */
typedef struct {
    double positions[N_HOLONOMIC + 1]; /* one more, because C has no array of length 0 */
    double velocities[N_CONSTRAINTS];
    double jacobian[N_CONSTRAINTS * N_COORDINATES];
} MasslessValues;

/* The equations A change = - residuals of the first coordinates without mass, size of them. */
typedef struct {
    int size;
    double matrix[N_MASSLESS * N_MASSLESS];
    int rows[N_MASSLESS];
} Slopes;

static void evaluate_massless(const Instance *instance, const double states[], MasslessValues *values) {
    const State *state = &instance->state;
    mechanism_constraints(state->time, states, state->inputs, state->parameters, values->positions, values->velocities,
                          values->jacobian);
}

/* Returns false if the forces do not depend on some of the coordinates. */
static bool factorize_slopes(const double jacobian[], int size, Slopes *slopes) {
    slopes->size = size;
    for (int k = 0; k < size; k++) {
        for (int i = 0; i < size; i++) {
            slopes->matrix[k * size + i] = jacobian[MASSLESS_CONSTRAINTS[k] * N + MASSLESS_COORDINATES[i]];
        }
    }
    return lu_factorize(slopes->matrix, slopes->rows, size);
}

/* change[size], by coordinate, that takes residuals[m], by constraint, away. */
static void solve_slopes(Arena *arena, const Slopes *slopes, const double residuals[], double change[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, right, N_MASSLESS);
    for (int k = 0; k < slopes->size; k++) {
        right[k] = -residuals[MASSLESS_CONSTRAINTS[k]];
    }
    lu_solve(slopes->matrix, slopes->rows, slopes->size, right, change);
    arena_release(mark);
}

/* moving[n] = kept[size] + length change[size] */
static void move_unknowns(double moving[], const double kept[], double length, const double change[], int size) {
    for (int i = 0; i < size; i++) {
        moving[MASSLESS_COORDINATES[i]] = kept[i] + length * change[i];
    }
}

/* The greatest residual relative to what a nominal displacement of the coordinate makes, or its present displacement if
   that is more; infinite for one that is not finite. */
static double size_of(const MasslessValues *values, const double states[]) {
    double greatest = 0.0;
    for (int k = 0; k < N_MASSLESS_POSITIONS; k++) {
        const int row = MASSLESS_CONSTRAINTS[k];
        double scale = 0.0;
        for (int i = 0; i < N_MASSLESS_POSITIONS; i++) {
            const int column = MASSLESS_COORDINATES[i];
            const double reach = fmax(NOMINAL_STATES[column], fabs(states[column]));
            scale = fmax(scale, fabs(values->jacobian[row * N + column]) * reach);
        }
        const double relative = fabs(values->positions[row]) / (scale > 0.0 ? scale : 1.0);
        if (!(relative <= greatest)) {
            greatest = isfinite(relative) ? relative : HUGE_VAL;
        }
    }
    return greatest;
}

bool massless_report(Instance *instance, const double residuals[], int size) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, concerned, N_COORDINATES);
    Failure *failure = &instance->failure;
    for (int k = 0; k < size; k++) {
        concerned[MASSLESS_COORDINATES[k]] = true;
        failure->constraints[k] = MASSLESS_CONSTRAINTS[k];
        failure->residuals[k] = residuals[MASSLESS_CONSTRAINTS[k]];
    }
    failure->count = size;
    return arena_leave(mark, report_coordinates(instance, FAILURE_MASSLESS, instance->state.time, concerned));
}

/* One step of Newton's method, halved until the residual falls. Returns false, and the states as they were, if it does
   not fall. Equations that are met already get one trial only, because what is left is rounding. */
static bool improve(const Instance *instance, double states[], MasslessValues *values, double *size) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, kept, N_MASSLESS);
    WORK(mark, double, change, N_MASSLESS);
    WORK_OF(mark, Slopes, slopes);
    WORK_OF(mark, MasslessValues, trial);
    if (!factorize_slopes(values->jacobian, N_MASSLESS_POSITIONS, slopes)) {
        return arena_leave(mark, false);
    }
    solve_slopes(instance->arena, slopes, values->positions, change);
    for (int i = 0; i < N_MASSLESS_POSITIONS; i++) {
        kept[i] = states[MASSLESS_COORDINATES[i]];
    }
    double length = 1.0;
    for (int trials = *size <= ACCEPTED ? 1 : MOST_LENGTHS; trials > 0; trials--, length *= 0.5) {
        move_unknowns(states, kept, length, change, N_MASSLESS_POSITIONS);
        evaluate_massless(instance, states, trial);
        const double found = size_of(trial, states);
        if (found < *size) {
            *values = *trial;
            *size = found;
            return arena_leave(mark, true);
        }
    }
    move_unknowns(states, kept, 0.0, change, N_MASSLESS_POSITIONS);
    return arena_leave(mark, false);
}

static bool solve_positions(Instance *instance, double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, MasslessValues, values);
    evaluate_massless(instance, states, values);
    double size = size_of(values, states);
    for (int i = 0; i < MOST_MASSLESS_ITERATIONS && size > NOISE && improve(instance, states, values, &size); i++) {
    }
    return arena_leave(mark, size <= ACCEPTED || massless_report(instance, values->positions, N_MASSLESS_POSITIONS));
}

static bool solve_velocities(Instance *instance, double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N_MASSLESS);
    WORK_OF(mark, Slopes, slopes);
    WORK_OF(mark, MasslessValues, values);
    move_unknowns(states + N, REST, 0.0, REST, N_MASSLESS);
    evaluate_massless(instance, states, values);
    if (!factorize_slopes(values->jacobian, N_MASSLESS, slopes)) {
        return arena_leave(mark, massless_report(instance, values->velocities, N_MASSLESS));
    }
    solve_slopes(instance->arena, slopes, values->velocities, change);
    move_unknowns(states + N, REST, 1.0, change, N_MASSLESS);
    return arena_leave(mark, all_finite(change, N_MASSLESS) ||
                                 massless_report(instance, values->velocities, N_MASSLESS));
}

bool massless_settle(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    State *state = &instance->state;
    if (state->settled) {
        return arena_leave(mark, true);
    }
    memcpy(states, state->states, N_STATES * sizeof(double));
    move_unknowns(states, state->massless[0], 0.0, state->massless[0], N_MASSLESS_POSITIONS);
    if ((N_MASSLESS_POSITIONS > 0 && !solve_positions(instance, states)) || !solve_velocities(instance, states)) {
        return arena_leave(mark, false);
    }
    memcpy(state->states, states, N_STATES * sizeof(double));
    state->settled = 1;
    return arena_leave(mark, true);
}

void massless_keep(State *state) {
    for (int i = 0; i < N_MASSLESS; i++) {
        state->massless[0][i] = state->states[MASSLESS_COORDINATES[i]];
        state->massless[1][i] = state->states[N + MASSLESS_COORDINATES[i]];
    }
    state->displaced = 0;
}

bool massless_return(Instance *instance) {
    State *state = &instance->state;
    if (!state->displaced) {
        return false;
    }
    move_unknowns(state->states, state->massless[0], 0.0, state->massless[0], N_MASSLESS_POSITIONS);
    move_unknowns(state->states + N, state->massless[1], 0.0, state->massless[1], N_MASSLESS);
    state->settled = 0;
    instance_forget_motion(instance);
    return true;
}

/* Is the change of the forces with what has no mass smaller, by the factor part, than that with the other coordinates,
   in nominal values? */
static bool hardly_depend(Arena *arena, const double jacobian[], double part, Slopes *slopes) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, scaled, N_CONSTRAINTS * N_COORDINATES);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        double scale = 0.0;
        for (int i = 0; i < N; i++) {
            scale = fmax(scale, fabs(jacobian[k * N + i]) * NOMINAL_STATES[i]);
        }
        for (int i = 0; i < N; i++) {
            scaled[k * N + i] = jacobian[k * N + i] * NOMINAL_STATES[i] / (scale > 0.0 ? scale : 1.0);
        }
    }
    bool found = !factorize_slopes(scaled, N_MASSLESS, slopes);
    for (int k = 0; k < N_MASSLESS && !found; k++) {
        found = part * fabs(slopes->matrix[k * N_MASSLESS + k]) > 1.0; /* inverse pivots */
    }
    return arena_leave(mark, found);
}

void massless_explain_failure(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Slopes, slopes);
    WORK_OF(mark, MasslessValues, values);
    evaluate_massless(instance, instance->state.states, values);
    if (instance->failure.kind == FAILURE_ACCURACY &&
        hardly_depend(instance->arena, values->jacobian, SINGULAR_SOON, slopes)) {
        massless_report(instance, values->velocities, N_MASSLESS);
    }
    arena_release(mark);
}

bool massless_settle_seed(Instance *instance, Seed *seed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, residuals, N_RESIDUALS);
    WORK(mark, double, change, N_MASSLESS);
    WORK_OF(mark, Slopes, slopes);
    WORK_OF(mark, MasslessValues, values);
    const State *state = &instance->state;
    evaluate_massless(instance, state->states, values);
    for (int level = N_MASSLESS_POSITIONS > 0 ? 0 : 1; level < 2; level++) {
        const int size = level == 0 ? N_MASSLESS_POSITIONS : N_MASSLESS;
        const double *rows = residuals + N_UNKNOWNS + (level == 0 ? N_CONSTRAINTS : 0);
        if (!factorize_slopes(values->jacobian, size, slopes)) {
            return arena_leave(mark, massless_report(instance, level == 0 ? values->positions : values->velocities,
                                         size));
        }
        mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters,
                                   instance->cache.accelerations, seed->time, seed->states, seed->inputs,
                                   seed->parameters, residuals);
        solve_slopes(instance->arena, slopes, rows, change);
        move_unknowns(seed->states + level * N, REST, 1.0, change, size);
    }
    return arena_leave(mark, true);
}
