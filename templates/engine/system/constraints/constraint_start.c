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

enum { MOST_START_ITERATIONS = 60, MOST_HALVINGS = 12 };

static const double AWAY = 0.1;       /* nominal displacements from a singular position, where it is left behind */

/* The greatest relative residual at these states. */
static double size_at(const Values *values, Level level, const double states[]) {
    return residual_size(values, level, residual_unit(level, states), NULL);
}

/* change[n]: the least change of the free states, in nominal values, that takes residuals[rows] away to first order. */
static void least_change(ConstraintFactorization *work, const double jacobian[], const double residuals[], Level level,
                         Freedom freedom, double damping, double change[]) {
    double right[N_CONSTRAINTS];
    double multipliers[N_CONSTRAINTS];
    for (int k = 0; k < rows_of(level); k++) {
        right[k] = -residuals[k];
    }
    start_factorize(work, jacobian, level, freedom, damping);
    constraints_solve(work, right, NULL, multipliers);
    memset(change, 0, N * sizeof(double));
    constraints_respond(work, multipliers, change);
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
    const State *state = &instance->state;
    ConstraintFactorization *work = &instance->scratch.system.constraints;
    double *moving = states + (level == POSITIONS ? 0 : N);
    double change[N_COORDINATES];
    double kept[N_COORDINATES];
    Values values, trial;
    residuals_evaluate(instance, state->time, states, state->inputs, &values);
    for (int i = 0; i < MOST_START_ITERATIONS && size_at(&values, level, states) > 1e-3 * MET; i++) {
        least_change(work, values.jacobian, level == POSITIONS ? values.positions : values.velocities, level, freedom,
                     damping_of(size_at(&values, level, states)), change);
        memcpy(kept, moving, sizeof kept);
        double length = 1.0;
        for (int halvings = 0; ; halvings++, length *= 0.5) {
            for (int j = 0; j < N; j++) {
                moving[j] = kept[j] + length * change[j];
            }
            residuals_evaluate(instance, state->time, states, state->inputs, &trial);
            if (scaled_square(&trial, level, work->scale) < scaled_square(&values, level, work->scale)) {
                break;
            }
            if (halvings == MOST_HALVINGS) {
                memcpy(moving, kept, sizeof kept);
                return;
            }
        }
        values = trial;
    }
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
    const State *state = &instance->state;
    double before[N_STATES];
    Values values;
    for (int freedom = GUESSES; freedom <= ALL_STATES; freedom++) {
        residuals_evaluate(instance, state->time, states, state->inputs, &values);
        const double size = size_at(&values, level, states);
        if (size <= MET) {
            return true;
        }
        if (freedom == ALL_STATES && size > TYPED) {
            break;
        }
        memcpy(before, states, sizeof before);
        iterate_start(instance, level, (Freedom)freedom, states);
        if (freedom == ALL_STATES) {
            remark_projection(instance, before, states);
        }
    }
    residuals_evaluate(instance, state->time, states, state->inputs, &values);
    return size_at(&values, level, states) <= MET ||
           report_constraints(instance, state->time, &values, level);
}

/* Which rows are independent at these states, and how far from the span of the others. */
static bool independent_rows(Instance *instance, const double states[], IndependentRows *rows) {
    const State *state = &instance->state;
    System *system = &instance->scratch.system;
    if (!system_factorize(instance, state->time, states, state->inputs, N_CONSTRAINTS, 0.0, system)) {
        return false;
    }
    rows->rank = system->constraints.rank;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const int row = system->constraints.order[k];
        rows->order[k] = row;
        rows->distance[row] = k < rows->rank ? constraints_distance(&system->constraints, k) : 0.0;
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

/* A start may be in a singular position, where a constraint that restricts the motion shows itself little or not at
   all. Such a constraint counts as it does further on, and is about to be lost at the start. */
static bool find_independent_rows(Instance *instance) {
    State *state = &instance->state;
    double states[N_STATES];
    IndependentRows further;
    state->rows_known = 0;
    if (!independent_rows(instance, state->states, &state->rows)) {
        return false;
    }
    if (state->rows.rank < N_CONSTRAINTS && move_on(instance, states) && independent_rows(instance, states, &further) &&
        further.rank > state->rows.rank) {
        state->rows = further;
    }
    instance->failure.kind = FAILURE_NONE;
    state->rows_known = 1;
    instance_forget_motion(instance); /* which may have been calculated with other rows, at these very states */
    return true;
}

bool constraints_regroup(Instance *instance) {
    State *state = &instance->state;
    state->rows_known = 0;
    state->rows_known = independent_rows(instance, state->states, &state->rows);
    return state->rows_known;
}

bool constraints_settle(Instance *instance) {
    State *state = &instance->state;
    double states[N_STATES];
    if (state->settled) {
        return true;
    }
    memcpy(states, state->states, sizeof states);
    if ((N_HOLONOMIC > 0 && !settle(instance, POSITIONS, states)) || !settle(instance, VELOCITIES, states)) {
        return false;
    }
    for (int i = 0; i < N_STATES; i++) {
        instance_assign(instance, &state->states[i], states[i]);
    }
    state->settled = 1;
    return find_independent_rows(instance);
}

/* The rows of the residuals' tangent that belong to a level. */
static const double *rows_in(const double change[], Level level) {
    return change + N_UNKNOWNS + (level == POSITIONS ? N_CONSTRAINTS : 0);
}

/* As settle does: the guesses follow first, and what they cannot take away moves all states of the level. */
static void settle_level_seed(Instance *instance, const Values *values, Level level, Seed *seed) {
    const State *state = &instance->state;
    double change[N_RESIDUALS];
    double answer[N_COORDINATES];
    for (int freedom = GUESSES; freedom <= ALL_STATES; freedom++) {
        mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters,
                                   instance->cache.accelerations, seed->time, seed->states, seed->inputs,
                                   seed->parameters, change);
        least_change(&instance->scratch.system.constraints, values->jacobian, rows_in(change, level), level,
                     (Freedom)freedom, 0.0, answer);
        for (int i = 0; i < N; i++) {
            seed->states[(level == POSITIONS ? 0 : N) + i] += answer[i];
        }
    }
}

void constraints_settle_seed(Instance *instance, Seed *seed) {
    const State *state = &instance->state;
    Values values;
    residuals_evaluate(instance, state->time, state->states, state->inputs, &values);
    for (int i = 0; i < N_STATES; i++) {
        seed->states[i] = GIVEN_STATES[i] ? seed->states[i] : 0.0;
    }
    for (int level = N_HOLONOMIC > 0 ? POSITIONS : VELOCITIES; level <= VELOCITIES; level++) {
        settle_level_seed(instance, &values, (Level)level, seed);
    }
}
