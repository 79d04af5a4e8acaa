/* The generated code solves M qdd = f without pivoting, in an order that suits the mechanism, and reports its pivots.
   Where one of them is no better than rounding error, the dense solver of linear_solve.h takes over. With constraints
   it likewise gives accelerations and multipliers in one formula, as long as the same constraints are independent as
   at the start, and clearly so; else see system.h. */
#include "accelerations.h"

#include <math.h>
#include <string.h>

#include "finite.h"
#include "system.h"

/* Names the coordinates whose accelerations are not finite. */
static bool report_not_finite(Instance *instance, double time, const double accelerations[]) {
    bool concerned[N_COORDINATES];
    for (int i = 0; i < N_COORDINATES; i++) {
        concerned[i] = !isfinite(accelerations[i]);
    }
    return report_coordinates(instance, FAILURE_NOT_FINITE, time, concerned);
}

#if N_CONSTRAINTS > 0

/* The part of the square of its distance at the start from where on a constraint may be about to be lost. */
static const double STILL_THERE = 1e-3;

double stabilisation(const Instance *instance) {
    return instance->type == fmi2ModelExchange ? STABILISATION : 0.0;
}

/* drift[m]: what is added to G qdd + gamma = 0 for that. */
static void find_drift(const Instance *instance, double time, const double states[], const double inputs[],
                       double drift[]) {
    double positions[N_HOLONOMIC + 1], velocities[N_CONSTRAINTS], jacobian[N_CONSTRAINTS * N_COORDINATES];
    const double rate = stabilisation(instance);
    memset(drift, 0, N_CONSTRAINTS * sizeof(double));
    if (rate > 0.0) {
        mechanism_constraints(time, states, inputs, instance->state.parameters, positions, velocities, jacobian);
        for (int k = 0; k < N_CONSTRAINTS; k++) {
            drift[k] = 2.0 * rate * velocities[k] + (k < N_HOLONOMIC ? rate * rate * positions[k] : 0.0);
        }
    }
}

/* What is remembered of a step serves for that many times as drift takes to be damped. */
static const double STALE = 10.0;

/* The accelerations to go on with where a constraint is about to be lost: those at the last accepted step, so that the
   branch with continuous velocities is followed. Importers may tell of few of their steps: from the last one they told
   of the accelerations are continued by their Taylor series, for some time. NULL if there are none. */
static const double *usual_accelerations(Instance *instance, double time) {
    const State *state = &instance->state;
    double *usual = instance->scratch.usual;
    if (instance->type == fmi2CoSimulation) {
        return state->first_stage + N_COORDINATES;
    }
    const double span = time - state->usual_time;
    for (int i = 0; i < N_COORDINATES; i++) {
        usual[i] = state->usual[0][i] + span * (state->usual[1][i] + 0.5 * span * state->usual[2][i]);
    }
    return state->usual_known && fabs(span) * STABILISATION < STALE ? usual : NULL;
}

/* Is every constraint as clearly independent, or redundant, as the formula has it, and none about to be lost? */
static bool formula_holds(const Instance *instance, const double margins[], const double squares[]) {
    const IndependentRows *known = &instance->state.rows;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const double usual = instance->state.rows_known ? known->distance[k] : 0.0;
        if (!(margins[k] > 0.0) || !(squares[k] >= STILL_THERE * usual * usual)) {
            return false;
        }
    }
    return true;
}

bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[],
                      double unknowns[]) {
    System *system = &instance->scratch.system;
    double drift[N_CONSTRAINTS], pivots[N_COORDINATES], margins[N_CONSTRAINTS], squares[N_CONSTRAINTS];
    find_drift(instance, time, states, inputs, drift);
    mechanism_accelerations(time, states, inputs, instance->state.parameters, drift, unknowns, pivots, margins,
                            squares);
    if (!formula_holds(instance, margins, squares) || !pivots_sound(instance, pivots)) {
        double below[N_CONSTRAINTS];
        if (!system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
            return false;
        }
        for (int k = 0; k < N_CONSTRAINTS; k++) {
            below[k] = -system->gamma[k] - drift[k];
        }
        system_solve(system, system->forcing, below, usual_accelerations(instance, time), unknowns);
    }
    return all_finite(unknowns, N_UNKNOWNS) || report_not_finite(instance, time, unknowns);
}

void multipliers_spread(const System *system, double unknowns[]) {
    constraints_spread(&system->constraints, unknowns + N_COORDINATES);
}

bool multipliers_unique(const Instance *instance) {
    return instance->state.rows_known && instance->state.rows.rank == N_CONSTRAINTS;
}

#else

void multipliers_spread(const System *system, double unknowns[]) {
    (void)system;
    (void)unknowns;
}

bool multipliers_unique(const Instance *instance) {
    (void)instance;
    return true;
}

bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[],
                             double accelerations[]) {
    const State *state = &instance->state;
    System *system = &instance->scratch.system;
    double pivots[N_COORDINATES];

    mechanism_accelerations(time, states, inputs, state->parameters, accelerations, pivots);
    if (!pivots_sound(instance, pivots)) {
        system->dense = true;
        if (!system_factorize_densely(instance, time, states, inputs, system)) {
            return false;
        }
        system_solve(system, instance->scratch.forcing, NULL, NULL, accelerations);
    }
    return all_finite(accelerations, N_COORDINATES) || report_not_finite(instance, time, accelerations);
}

#endif
