/* The system with constraints, and what the engine adds to it. Each function has the operations of the one that it
   transposes, from the last one to the first. */
#include <string.h>

#include "adjoint_constraints.h"
#include "adjoint_parts.h"
#include "constraint_factorization.h"
#include "free_states.h"
#include "mass_matrix.h"
#include "seeds.h"

/* constraints_solve: b[rows] for weights of the multipliers. A row that is held counts less, and so does its weight. */
static void solve_adjoint(Arena *arena, const ConstraintFactorization *f, const double multipliers[], double b[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, z, K);
    memset(b, 0, K * sizeof(double));
    for (int i = 0; i < f->rank; i++) {
        const int row = f->order[i];
        z[i] = f->scale[row] * multipliers[row];
        for (int j = 0; j < i; j++) {
            z[i] -= f->factor[i * K + j] * z[j];
        }
        z[i] /= f->factor[i * K + i];
    }
    for (int i = f->rank - 1; i >= 0; i--) {
        const int row = f->order[i];
        z[i] *= (1.0 - f->held[row]) / f->factor[i * K + i];
        for (int j = 0; j < i; j++) {
            z[j] -= f->factor[i * K + j] * z[i];
        }
        b[row] = f->scale[row] * z[i];
    }
    arena_release(mark);
}

/* The product of row k of a matrix, (m, n), and a vector. */
static double row_times(const double matrix[], int k, const double vector[]) {
    double sum = 0.0;
    for (int i = 0; i < N; i++) {
        sum += matrix[k * N + i] * vector[i];
    }
    return sum;
}

void system_answer_adjoint(const System *system, const double unknowns[], double change[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK(mark, double, multipliers, K);
    WORK(mark, double, accelerations, N);
    const ConstraintFactorization *f = &system->constraints;
    double *below = change + N;
    memcpy(accelerations, unknowns, N * sizeof(double));
    for (int k = 0; k < K; k++) {
        multipliers[k] = unknowns[N + k] + row_times(f->response, k, unknowns);
    }
    solve_adjoint(system->arena, f, multipliers, below);
    for (int k = 0; k < K; k++) {
        for (int i = 0; i < N; i++) {
            accelerations[i] -= f->jacobian[k * N + i] * below[k];
        }
    }
    mass_divide(system, accelerations, change);
    for (int k = 0; k < K; k++) {
        below[k] += system->weight[k] > 0.0 ? system->weight[k] * row_times(f->jacobian, k, change) : 0.0;
    }
    for (int i = 0; i < N_UNKNOWNS; i++) {
        change[i] = -change[i];
    }
    arena_release(mark);
}

void accelerations_stabilise_adjoint(const Instance *instance, double change[]) {
    const double rate = instance->policy->stabilise ? STABILISATION : 0.0;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        change[N_UNKNOWNS + k] += 2.0 * rate * change[N + k];
    }
    for (int k = 0; k < N_HOLONOMIC; k++) {
        change[N_UNKNOWNS + N_CONSTRAINTS + k] += rate * rate * change[N + k];
    }
}

void add_constraints_adjoint(const Instance *instance, const double positions[], const double velocities[],
                             Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Seed, term);
    const State *state = &instance->state;
    memset(term, 0, sizeof *term);
    mechanism_constraints_adjoint(state->time, state->states, state->inputs, state->parameters, positions, velocities,
                                  &term->time, term->states, term->inputs, term->parameters);
    seed_add(sensitivity, term);
    arena_release(mark);
}

/* The changes of the states of a level, the last one first. */
static void level_adjoint(Instance *instance, const Values *values, Level level, Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, multipliers, K);
    WORK(mark, double, rows, K);
    WORK_ZEROS(mark, double, nothing, K);
    ConstraintFactorization *work = &instance->scratch.system.constraints;
    for (int freedom = ALL_STATES; freedom >= GUESSES; freedom--) {
        start_factorize(instance->arena, work, values->jacobian, level, (Freedom)freedom, 0.0);
        for (int k = 0; k < rows_of(level); k++) {
            multipliers[k] = row_times(work->response, k, sensitivity->states + (level == POSITIONS ? 0 : N));
        }
        solve_adjoint(instance->arena, work, multipliers, rows);
        for (int k = 0; k < K; k++) {
            rows[k] = -rows[k];
        }
        add_constraints_adjoint(instance, level == POSITIONS ? rows : nothing, level == POSITIONS ? nothing : rows,
                                sensitivity);
    }
    arena_release(mark);
}

void constraints_settle_adjoint(Instance *instance, Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, values);
    const State *state = &instance->state;
    residuals_evaluate(instance, state->time, state->states, state->inputs, values);
    level_adjoint(instance, values, VELOCITIES, sensitivity);
    for (int i = N; i < 2 * N; i++) {
        sensitivity->states[i] = GIVEN_STATES[i] ? sensitivity->states[i] : 0.0;
    }
    if (N_HOLONOMIC > 0) {
        level_adjoint(instance, values, POSITIONS, sensitivity);
    }
    for (int i = 0; i < N_STATES; i++) {
        sensitivity->states[i] = GIVEN_STATES[i] ? sensitivity->states[i] : 0.0;
    }
    arena_release(mark);
}
