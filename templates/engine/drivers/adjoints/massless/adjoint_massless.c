/* massless_settle_seed backwards: velocities first, then positions. */
#include "adjoint_constraints.h"
#include "adjoint_parts.h"
#include "constraint_residuals.h"
#include "failure.h"
#include "lu.h"
#include "massless.h"

/* rows[size] = - A^-T weights[size] for the square part A of the Jacobian; false if there is no definite answer. */
static bool solve_massless_transposed(Arena *arena, const double jacobian[], int size, const double weights[],
                             double rows[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, matrix, N_MASSLESS * N_MASSLESS);
    WORK(mark, int, order, N_MASSLESS);
    for (int k = 0; k < size; k++) {
        for (int i = 0; i < size; i++) {
            matrix[i * size + k] = jacobian[MASSLESS_CONSTRAINTS[k] * N + MASSLESS_COORDINATES[i]];
        }
    }
    if (!lu_factorize(matrix, order, size)) {
        return arena_leave(mark, false);
    }
    lu_solve(matrix, order, size, weights, rows);
    for (int k = 0; k < size; k++) {
        rows[k] = -rows[k];
    }
    return arena_leave(mark, true);
}

/* The answers of positions or velocities: their weights go to what they follow from. */
static bool massless_level_adjoint(Instance *instance, const Values *values, Level level, Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, weights, N_MASSLESS);
    WORK(mark, double, found, N_MASSLESS);
    WORK_ZEROS(mark, double, rows, N_CONSTRAINTS);
    WORK_ZEROS(mark, double, nothing, N_CONSTRAINTS);
    const int size = level == POSITIONS ? N_MASSLESS_POSITIONS : N_MASSLESS;
    double *states = sensitivity->states + (level == POSITIONS ? 0 : N);
    for (int i = 0; i < size; i++) {
        weights[i] = states[MASSLESS_COORDINATES[i]];
    }
    if (!solve_massless_transposed(instance->arena, values->jacobian, size, weights, found)) {
        const double *wrong = level == POSITIONS ? values->positions : values->velocities;
        return arena_leave(mark, massless_report(instance, wrong, size));
    }
    for (int k = 0; k < size; k++) {
        rows[MASSLESS_CONSTRAINTS[k]] = found[k];
    }
    add_constraints_adjoint(instance, level == POSITIONS ? rows : nothing, level == POSITIONS ? nothing : rows,
                            sensitivity);
    for (int i = 0; i < size; i++) {
        states[MASSLESS_COORDINATES[i]] = 0.0;
    }
    return arena_leave(mark, true);
}

bool massless_settle_adjoint(Instance *instance, Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, values);
    const State *state = &instance->state;
    residuals_evaluate(instance, state->time, state->states, state->inputs, values);
    return arena_leave(mark, massless_level_adjoint(instance, values, VELOCITIES, sensitivity) &&
                                 (N_MASSLESS_POSITIONS == 0 ||
                                 massless_level_adjoint(instance, values, POSITIONS, sensitivity)));
}
