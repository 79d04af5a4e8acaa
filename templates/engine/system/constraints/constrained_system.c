/* The system with constraints. Source of the replacement of a singular M: Benzi, Golub, Liesen, Numerical solution of
   saddle point problems, Acta Numerica 2005, section 5.2 (the augmented Lagrangian). */
#include <math.h>
#include <string.h>

#include "constraint_factorization.h"
#include "contacts.h"
#include "mass_matrix.h"
#include "system.h"

/* mass += G^T W G. Each weight makes its row count as much as the largest inertia of the coordinates it ties: other
   inertias may be larger by any factor. */
static void add_constraints(System *system, double mass[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK(mark, double, inertias, N);
    double heaviest = 0.0;
    for (int i = 0; i < N; i++) {
        inertias[i] = fabs(mass[i * N + i]);
        heaviest = fmax(heaviest, inertias[i]);
    }
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const double *row = system->constraints.jacobian + k * N;
        double square = 0.0, largest = 0.0;
        for (int i = 0; i < N; i++) {
            square += row[i] * row[i];
            largest = row[i] != 0.0 ? fmax(largest, inertias[i]) : largest;
        }
        largest = largest > 0.0 ? largest : heaviest;
        system->weight[k] = square > 0.0 ? (largest > 0.0 ? largest : 1.0) / square : 0.0;
        for (int i = 0; i < N; i++) {
            for (int j = 0; j <= i; j++) {
                mass[i * N + j] += system->weight[k] * row[i] * row[j];
            }
        }
    }
    arena_release(mark);
}

/* Factorises M; where M is singular, M with the constraints added to it. Returns false, with instance->failure, if that
   is singular too. */
static bool factorize_constrained_mass(Instance *instance, double time, const double states[], const double inputs[],
                              System *system) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, concerned, N_COORDINATES);
    double *mass = instance->scratch.mass;
    MassOutcome outcome = mass_evaluate(instance, time, states, inputs, system, concerned);
    if (outcome == MASS_SINGULAR) {
        add_constraints(system, mass);
        outcome = mass_factorize(mass, &system->pivoted, concerned);
    }
    return arena_leave(mark, mass_accept(instance, outcome, time, concerned));
}

bool system_factorize(Instance *instance, double time, const double states[], const double inputs[], int rows,
                      double damping, System *system) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pivots, N_COORDINATES);
    ConstraintFactorization *constraints = &system->constraints;
    memset(system->weight, 0, sizeof system->weight);
    mechanism_constrained(time, states, inputs, instance->state.parameters, system->factor, pivots, system->forcing,
                          constraints->jacobian, system->gamma);
    system->dense = !pivots_sound(instance, pivots);
    if (system->dense && !factorize_constrained_mass(instance, time, states, inputs, system)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < rows; k++) {
        mass_divide(system, constraints->jacobian + k * N, constraints->response + k * N);
    }
    constraints_factorize(instance->arena, constraints, rows,
                          instance->state.rows_known ? &instance->state.rows : NULL, damping);
    return arena_leave(mark, true);
}

/* With a = M^-1 right and G (a + M^-1 G^T multipliers) = below. */
void system_solve(const System *system, const double right[], const double *below, const double *usual,
                  double unknowns[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK_ZEROS(mark, double, rest, N_CONSTRAINTS);
    WORK_ZEROS(mark, double, kept, N_CONSTRAINTS);
    WORK(mark, double, mended, N_COORDINATES);
    const ConstraintFactorization *constraints = &system->constraints;
    double *multipliers = unknowns + N;
    const bool keeps = usual != NULL && constraints->holding;
    memcpy(mended, right, N_COORDINATES * sizeof(double));
    for (int k = 0; k < constraints->rows; k++) {
        for (int i = row_begin(constraints, k); i < row_end(constraints, k) && system->weight[k] > 0.0; i++) {
            mended[i] += constraints->jacobian[k * N + i] * system->weight[k] * below[k];
        }
    }
    mass_divide(system, mended, unknowns);
    for (int k = 0; k < constraints->rows; k++) {
        rest[k] = below[k];
        for (int i = row_begin(constraints, k); i < row_end(constraints, k); i++) {
            rest[k] -= constraints->jacobian[k * N + i] * unknowns[i];
        }
        for (int i = row_begin(constraints, k); keeps && i < row_end(constraints, k); i++) {
            kept[k] += constraints->jacobian[k * N + i] * (usual[i] - unknowns[i]);
        }
    }
    constraints_solve(system->arena, constraints, rest, keeps ? kept : NULL, multipliers);
    constraints_respond(constraints, multipliers, unknowns);
    arena_release(mark);
}

void multipliers_spread(const System *system, double unknowns[]) {
    constraints_spread(system->arena, &system->constraints, unknowns + N_COORDINATES);
}

bool multipliers_unique(const Instance *instance) {
    return instance->state.rows_known && instance->state.rows.rank + contacts_idle(instance) == N_CONSTRAINTS;
}
