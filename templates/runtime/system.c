/* Source of the replacement of a singular M: Benzi, Golub, Liesen, Numerical solution of saddle point problems, Acta
   Numerica 2005, section 5.2 (the augmented Lagrangian). */
#include "system.h"

#if N_MASSLESS > 0
#include "massless.h"
#endif

#include <float.h>
#include <math.h>
#include <string.h>

enum { N = N_COORDINATES };

/* A pivot below the inertia of its coordinate times this is suspicious; the dense solver decides. */
static const double SUSPICIOUS = 1e4 * DBL_EPSILON;

/* A pivot that far below the largest one explains why a solver cannot go on, ... */
static const double EXPLAINS = 1e-6;

/* ... and that far may become the reason, with velocities that change by their size so often in a usual solver step. */
static const double FORETELLS = 1e-4, SUDDEN = 10.0;

/* A fixed step may leap over a singular M: at one of its ends a pivot is that far below the largest one, ... */
static const double LEAPT_OVER = 1e-2;

/* ... and was not at the start, where light bodies show. */
static const double REGULAR = 0.1;

/* Brings the least acceptable pivots up to date: relative to the diagonal of M at the start, with the present
   parameters, so that they follow from the State and a restored run repeats itself. */
static const double *least_pivots(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->least_pivots_valid) {
        double *mass = instance->scratch.mass;
        mechanism_dynamics(state->start_time, START_STATES, START_INPUTS, state->parameters, mass,
                           instance->scratch.forcing);
        for (int i = 0; i < N; i++) {
            const double inertia = fabs(mass[i * N + i]);
            cache->least_pivots[i] = isfinite(inertia) ? SUSPICIOUS * inertia : 0.0;
        }
        cache->least_pivots_valid = true;
    }
    return cache->least_pivots;
}

bool pivots_sound(Instance *instance, const double pivots[]) {
    const double *least = least_pivots(instance);
    for (int i = 0; i < N; i++) {
        if (!(pivots[i] > least[i])) {
            return false;
        }
    }
    return true;
}

bool report_coordinates(Instance *instance, FailureKind kind, double time, const bool coordinates[]) {
    instance->failure.kind = kind;
    instance->failure.time = time;
    memcpy(instance->failure.coordinates, coordinates, sizeof instance->failure.coordinates);
    return false;
}

#if N_CONSTRAINTS > 0
/* mass += G^T W G, each weight such that its row counts as much as the largest inertia of the coordinates it ties: other
   ones may be larger by any factor. */
static void add_constraints(System *system, double mass[]) {
    double inertias[N];
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
}
#endif

bool system_factorize_densely(Instance *instance, double time, const double states[], const double inputs[],
                              System *system) {
    double *mass = instance->scratch.mass;
    bool concerned[N_COORDINATES] = {false};
    mechanism_dynamics(time, states, inputs, instance->state.parameters, mass, instance->scratch.forcing);
    MassOutcome outcome = mass_factorize(mass, &system->pivoted, concerned);
#if N_CONSTRAINTS > 0
    if (outcome == MASS_SINGULAR) {
        add_constraints(system, mass);
        outcome = mass_factorize(mass, &system->pivoted, concerned);
    }
#endif
    if (outcome == MASS_REGULAR) {
        return true;
    }
    return report_coordinates(instance, outcome == MASS_SINGULAR ? FAILURE_SINGULAR : FAILURE_NOT_FINITE, time,
                              concerned);
}

/* Is M singular at these states but for this part? Flags the coordinates concerned. */
static bool nearly_singular(Instance *instance, const double states[], double part, bool concerned[]) {
    const State *state = &instance->state;
    if (N_CONSTRAINTS > 0) {
        return false; /* the whole system is to be regular, not M */
    }
    mechanism_dynamics(state->time, states, state->inputs, state->parameters, instance->scratch.mass,
                       instance->scratch.forcing);
    return mass_nearly_singular(instance->scratch.mass, part, &instance->scratch.system.pivoted, concerned);
}

void system_explain_failure(Instance *instance) {
    bool concerned[N_COORDINATES] = {false};
    if (instance->failure.kind == FAILURE_ACCURACY && nearly_singular(instance, instance->state.states, EXPLAINS, concerned)) {
        report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned);
    }
#if N_MASSLESS > 0
    massless_explain_failure(instance);
#endif
}

bool system_runs_into_singularity(Instance *instance, const double accelerations[]) {
    const double *velocities = instance->state.states + N;
    bool concerned[N_COORDINATES] = {false};
    bool sudden = false;
    for (int i = 0; i < N; i++) {
        const double usual = (fabs(velocities[i]) + NOMINAL_STATES[N + i]) / DEFAULT_SOLVER_STEP;
        sudden = sudden || fabs(accelerations[i]) > SUDDEN * usual;
    }
    return sudden && nearly_singular(instance, instance->state.states, FORETELLS, concerned) &&
           !report_coordinates(instance, FAILURE_NEARLY_SINGULAR, instance->state.time, concerned);
}

bool system_leaps_over_singularity(Instance *instance, double length) {
    const double *old = instance->state.states, *new = instance->scratch.new_states;
    bool concerned[N_COORDINATES] = {false}, ignored[N_COORDINATES] = {false};
    bool leaps = false;
    for (int i = N; i < N_STATES; i++) {
        const double change = new[i] - old[i];
        const double mean = 0.5 * (instance->state.first_stage[i] + instance->scratch.new_derivatives[i]);
        leaps = leaps || fabs(change - length * mean) > fabs(change) + fabs(old[i]) + NOMINAL_STATES[i];
    }
    return leaps &&
           (nearly_singular(instance, old, LEAPT_OVER, concerned) ||
            nearly_singular(instance, new, LEAPT_OVER, concerned)) &&
           !nearly_singular(instance, START_STATES, REGULAR, ignored) &&
           !report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned);
}

/* a[n] = M^-1 b[n] */
static void solve_mass(const System *system, const double b[], double a[]) {
    if (system->dense) {
        memcpy(a, b, N * sizeof(double));
        mass_solve(&system->pivoted, a);
    } else {
        mechanism_solve(system->factor, b, a);
    }
}

#if N_CONSTRAINTS > 0

bool system_factorize(Instance *instance, double time, const double states[], const double inputs[], int rows,
                      double damping, System *system) {
    double pivots[N_COORDINATES];
    ConstraintFactorization *constraints = &system->constraints;
    memset(system->weight, 0, sizeof system->weight);
    mechanism_constrained(time, states, inputs, instance->state.parameters, system->factor, pivots, system->forcing,
                          constraints->jacobian, system->gamma);
    system->dense = !pivots_sound(instance, pivots);
    if (system->dense && !system_factorize_densely(instance, time, states, inputs, system)) {
        return false;
    }
    for (int k = 0; k < rows; k++) {
        solve_mass(system, constraints->jacobian + k * N, constraints->response + k * N);
    }
    constraints_factorize(constraints, rows, instance->state.rows_known ? &instance->state.rows : NULL, damping);
    return true;
}

/* With a = M^-1 right and G (a + M^-1 G^T multipliers) = below. */
void system_solve(const System *system, const double right[], const double *below, const double *usual,
                  double unknowns[]) {
    const ConstraintFactorization *constraints = &system->constraints;
    double *multipliers = unknowns + N;
    double rest[N_CONSTRAINTS];
    double kept[N_CONSTRAINTS] = {0.0};
    const bool keeps = usual != NULL && constraints->holding;
    double mended[N_COORDINATES];
    memcpy(mended, right, sizeof mended);
    for (int k = 0; k < constraints->rows; k++) {
        for (int i = 0; i < N && system->weight[k] > 0.0; i++) {
            mended[i] += constraints->jacobian[k * N + i] * system->weight[k] * below[k];
        }
    }
    solve_mass(system, mended, unknowns);
    for (int k = 0; k < constraints->rows; k++) {
        rest[k] = below[k];
        for (int i = 0; i < N; i++) {
            rest[k] -= constraints->jacobian[k * N + i] * unknowns[i];
        }
        for (int i = 0; keeps && i < N; i++) {
            kept[k] += constraints->jacobian[k * N + i] * (usual[i] - unknowns[i]);
        }
    }
    constraints_solve(constraints, rest, keeps ? kept : NULL, multipliers);
    constraints_respond(constraints, multipliers, unknowns);
}

#else

bool system_factorize(Instance *instance, double time, const double states[], const double inputs[], int rows,
                      double damping, System *system) {
    double pivots[N_COORDINATES];
    (void)rows; /* 0 */
    (void)damping;
    mechanism_factor(time, states, inputs, instance->state.parameters, system->factor, pivots);
    system->dense = !pivots_sound(instance, pivots);
    return !system->dense || system_factorize_densely(instance, time, states, inputs, system);
}

void system_solve(const System *system, const double right[], const double *below, const double *usual,
                  double unknowns[]) {
    (void)below; /* empty */
    (void)usual;
    solve_mass(system, right, unknowns);
}

#endif
