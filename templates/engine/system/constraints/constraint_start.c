/* Solving for start values that meet the constraints. Source: Deuflhard, Newton Methods for Nonlinear Problems, section
   4.4 (steps of least norm). */
#include <math.h>
#include <string.h>

#include "constraint_factorization.h"
#include "constraint_residuals.h"
#include "constraints.h"
#include "free_states.h"
#include "scale.h"
#include "system.h"

/* Bounds: of Newton steps, and of halvings of one step along which the residual has to fall. */
enum { MOST_START_ITERATIONS = 60, MOST_HALVINGS = 12 };

/* In nominal displacements: the distance from a singular position at which it is left behind. */
static const double AWAY = 0.1;

/* The greatest relative residual at these states. */
static double size_at(const Values *values, Level level, const double states[]) {
    return residual_size(values, level, residual_unit(level, states), NULL);
}

/* change[n]: the least change of the free states, in nominal values, that takes residuals[rows] away to first order. */
static void least_change(Arena *arena, ConstraintFactorization *work, const double jacobian[],
                         const double residuals[], Level level, Freedom freedom, double damping, double change[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, right, N_CONSTRAINTS);
    WORK(mark, double, multipliers, N_CONSTRAINTS);
    for (int k = 0; k < rows_of(level); k++) {
        right[k] = -residuals[k];
    }
    start_factorize(arena, work, jacobian, level, freedom, damping);
    constraints_solve(arena, work, right, NULL, multipliers);
    memset(change, 0, N * sizeof(double));
    constraints_respond(work, multipliers, change);
    arena_release(mark);
}

/* The square of the residuals' norm, rows scaled as for the step, along which it falls. Rows in which nothing may move
   count as they are. */
static double scaled_square(const Values *values, Level level, const double scale[]) {
    const double *residuals = level == POSITIONS ? values->positions : values->velocities;
    double square = 0.0;
    for (int k = 0; k < rows_of(level); k++) {
        const double scaled = residuals[k] * (scale[k] > 0.0 ? scale[k] : 1.0);
        square += scaled * scaled;
    }
    return square;
}

/* Newton's method with steps of least norm, halved where the residual grows. */
static void iterate_start(Instance *instance, Level level, Freedom freedom, double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N_COORDINATES);
    WORK(mark, double, kept, N_COORDINATES);
    WORK_OF(mark, Values, values);
    WORK_OF(mark, Values, trial);
    const State *state = &instance->state;
    ConstraintFactorization *work = &instance->scratch.system.constraints;
    double *moving = states + (level == POSITIONS ? 0 : N);
    residuals_evaluate(instance, state->time, states, state->inputs, values);
    for (int i = 0; i < MOST_START_ITERATIONS && size_at(values, level, states) > 1e-3 * MET; i++) {
        least_change(instance->arena, work, values->jacobian,
                     level == POSITIONS ? values->positions : values->velocities, level, freedom,
                     damping_of(size_at(values, level, states)), change);
        memcpy(kept, moving, N_COORDINATES * sizeof(double));
        double length = 1.0;
        for (int halvings = 0; ; halvings++, length *= 0.5) {
            for (int j = 0; j < N; j++) {
                moving[j] = kept[j] + length * change[j];
            }
            residuals_evaluate(instance, state->time, states, state->inputs, trial);
            if (scaled_square(trial, level, work->scale) < scaled_square(values, level, work->scale)) {
                break;
            }
            if (halvings == MOST_HALVINGS) {
                memcpy(moving, kept, N_COORDINATES * sizeof(double));
                arena_release(mark);
                return;
            }
        }
        *values = *trial;
    }
    arena_release(mark);
}

/* Tells how far a given start was moved. */
static void remark_projection(const Instance *instance, const double before[], const double after[]) {
    int worst = 0;
    double furthest = 0.0;
    for (int i = 0; i < N_STATES; i++) {
        const double distance = fabs(after[i] - before[i]) / NOMINAL_STATES[i];
        worst = distance > furthest ? i : worst;
        furthest = fmax(furthest, distance);
    }
    if (instance->listener.start_moved != NULL) {
        instance->listener.start_moved(instance->listener.owner, worst, before[worst], after[worst]);
    }
}

static bool settle(Instance *instance, Level level, double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, N_STATES);
    WORK_OF(mark, Values, values);
    const State *state = &instance->state;
    for (int freedom = GUESSES; freedom <= ALL_STATES; freedom++) {
        residuals_evaluate(instance, state->time, states, state->inputs, values);
        const double size = size_at(values, level, states);
        if (size <= MET) {
            return arena_leave(mark, true);
        }
        if (freedom == ALL_STATES && size > TYPED) {
            break;
        }
        memcpy(before, states, N_STATES * sizeof(double));
        iterate_start(instance, level, (Freedom)freedom, states);
        if (freedom == ALL_STATES) {
            remark_projection(instance, before, states);
        }
    }
    residuals_evaluate(instance, state->time, states, state->inputs, values);
    return arena_leave(mark, size_at(values, level, states) <= MET ||
                                 report_constraints(instance, state->time, values, level));
}

/* rows: all of them, in their order, none of which is known to be independent yet. Their slopes are those at the states
   or, where clearly greater, a little beside them: a row that is much shorter than errors of the states make it counts
   as 0. Other rows count in full, so that their order is that of the generated formula. Beside is where each coordinate
   has moved by another part, the cosine of its number: no symmetry of a mechanism keeps a row short there. */
static void list_rows(Instance *instance, const double states[], IndependentRows *rows) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, beside, N_STATES);
    WORK_OF(mark, Values, values);
    memcpy(beside, states, N_STATES * sizeof(double));
    for (int i = 0; i < N; i++) {
        beside[i] += MET / sqrt(REDUNDANT) * NOMINAL_STATES[i] * cos((double)i);
    }
    residuals_evaluate(instance, instance->state.time, beside, instance->state.inputs, values);
    rows->rank = 0;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const double here = constraints_slope(instance->scratch.system.constraints.jacobian, k);
        const double there = constraints_slope(values->jacobian, k);
        rows->order[k] = k;
        rows->slope[k] = 2.0 * here < there ? there : here;
    }
    arena_release(mark);
}

/* Which rows are independent at these states, and how far from the span of the others. */
static bool independent_rows(Instance *instance, const double states[], IndependentRows *rows) {
    const State *state = &instance->state;
    ConstraintFactorization *found = &instance->scratch.system.constraints;
    if (!system_factorize(instance, state->time, states, state->inputs, N_CONSTRAINTS, 0.0,
                          &instance->scratch.system)) {
        return false;
    }
    list_rows(instance, states, rows);
    constraints_factorize(instance->arena, found, N_CONSTRAINTS, rows, 0.0);
    rows->rank = found->rank;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const int row = found->order[k];
        rows->order[k] = row;
        rows->distance[row] = k < rows->rank ? constraints_distance(found, k) : 0.0;
    }
    return true;
}

/* states[2n]: a little further on along the constraints, where the velocities at the start lead to. Returns false if
   nothing moves, or if no such states are found. */
static bool move_on(Instance *instance, double states[]) {
    const State *state = &instance->state;
    double fastest = 0.0;
    bool moved;
    for (int i = 0; i < N; i++) {
        fastest = fmax(fastest, fabs(state->states[N + i]) / NOMINAL_STATES[i]);
    }
    memcpy(states, state->states, sizeof state->states);
    for (int i = 0; i < N; i++) {
        states[i] += AWAY / fastest * state->states[N + i];
    }
    return fastest > 0.0 && constraints_project(instance, state->time, state->inputs, states, &moved);
}

/* Takes the greater slopes into both, and the rows further on where more of them are independent there. */
static void combine_rows(IndependentRows *rows, IndependentRows *further) {
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        rows->slope[k] = fmax(rows->slope[k], further->slope[k]);
        further->slope[k] = rows->slope[k];
    }
    if (further->rank > rows->rank) {
        *rows = *further;
    }
}

/* A start may be in a singular position, where a constraint that restricts the motion shows itself little or not at
   all. Such a constraint counts as it does further on, and is about to be lost at the start. */
static bool find_independent_rows(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK_OF(mark, IndependentRows, further);
    State *state = &instance->state;
    state->rows_known = 0;
    if (!independent_rows(instance, state->states, &state->rows)) {
        return arena_leave(mark, false);
    }
    if (state->rows.rank < N_CONSTRAINTS && move_on(instance, states) &&
        independent_rows(instance, states, further)) {
        combine_rows(&state->rows, further);
    }
    instance->failure.kind = FAILURE_NONE;
    state->rows_known = 1;
    instance_forget_motion(instance); /* which may have been calculated with other rows, at these very states */
    return arena_leave(mark, true);
}

bool constraints_regroup(Instance *instance) {
    State *state = &instance->state;
    state->rows_known = 0;
    state->rows_known = independent_rows(instance, state->states, &state->rows);
    return state->rows_known;
}

bool constraints_settle(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    State *state = &instance->state;
    if (state->settled) {
        return arena_leave(mark, true);
    }
    memcpy(states, state->states, N_STATES * sizeof(double));
    if ((N_HOLONOMIC > 0 && !settle(instance, POSITIONS, states)) || !settle(instance, VELOCITIES, states)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N_STATES; i++) {
        instance_assign(instance, &state->states[i], states[i]);
    }
    state->settled = 1;
    return arena_leave(mark, find_independent_rows(instance));
}

/* The rows of the residuals' tangent that belong to a level. */
static const double *rows_in(const double change[], Level level) {
    return change + N_UNKNOWNS + (level == POSITIONS ? N_CONSTRAINTS : 0);
}

/* As settle does: the guesses follow first, and what they cannot take away moves all states of the level. */
static void settle_level_seed(Instance *instance, const Values *values, Level level, Seed *seed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N_RESIDUALS);
    WORK(mark, double, answer, N_COORDINATES);
    const State *state = &instance->state;
    for (int freedom = GUESSES; freedom <= ALL_STATES; freedom++) {
        mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters,
                                   instance->cache.accelerations, seed->time, seed->states, seed->inputs,
                                   seed->parameters, change);
        least_change(instance->arena, &instance->scratch.system.constraints, values->jacobian,
                     rows_in(change, level), level, (Freedom)freedom, 0.0, answer);
        for (int i = 0; i < N; i++) {
            seed->states[(level == POSITIONS ? 0 : N) + i] += answer[i];
        }
    }
    arena_release(mark);
}

void constraints_settle_seed(Instance *instance, Seed *seed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, values);
    const State *state = &instance->state;
    residuals_evaluate(instance, state->time, state->states, state->inputs, values);
    for (int i = 0; i < N_STATES; i++) {
        seed->states[i] = GIVEN_STATES[i] ? seed->states[i] : 0.0;
    }
    for (int level = N_HOLONOMIC > 0 ? POSITIONS : VELOCITIES; level <= VELOCITIES; level++) {
        settle_level_seed(instance, values, (Level)level, seed);
    }
    arena_release(mark);
}
