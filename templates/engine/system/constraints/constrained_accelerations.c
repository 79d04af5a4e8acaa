/* With constraints. The generated code gives accelerations and multipliers in one formula, without pivoting, in an
   order that suits the mechanism, and reports its pivots. The formula holds as long as clearly the same constraints are
   independent as at the start; elsewhere the system of system.h is solved. */
#include <math.h>
#include <string.h>

#include "accelerations.h"
#include "constraint_factorization.h"
#include "constraints.h"
#include "contacts.h"
#include "failure.h"
#include "finite.h"
#include "mass_matrix.h"
#include "scale.h"
#include "system.h"

/* The rate (1/s) at which drift from the constraints is damped. */
static double stabilisation(const Instance *instance) {
    return instance->policy->stabilise ? STABILISATION : 0.0;
}

/* drift[m]: what is added to G qdd + gamma = 0 to bring phi back. */
static void find_drift(const Instance *instance, double time, const double states[], const double inputs[],
                       double drift[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, positions, N_HOLONOMIC + 1);
    WORK(mark, double, velocities, N_CONSTRAINTS);
    WORK(mark, double, jacobian, N_CONSTRAINTS * N_COORDINATES);
    const double rate = stabilisation(instance);
    memset(drift, 0, N_CONSTRAINTS * sizeof(double));
    if (rate > 0.0) {
        mechanism_constraints(time, states, inputs, instance->state.parameters, positions, velocities, jacobian);
        for (int k = 0; k < N_CONSTRAINTS; k++) {
            drift[k] = 2.0 * rate * velocities[k] + (k < N_HOLONOMIC ? rate * rate * positions[k] : 0.0);
        }
    }
    arena_release(mark);
}

/* In units of 1 / STABILISATION, the time (s) in which drift is damped: how long after a step that an importer reported
   the Taylor series from there stands for the accelerations. */
static const double STALE = 10.0;

/* The accelerations to go on with where a constraint is about to be lost: those at the last accepted step, so that the
   motion follows the branch with continuous velocities. An importer may report few of its steps; then the accelerations
   at the last reported one are continued by their Taylor series, for some time. NULL if there are none. */
static const double *usual_accelerations(Instance *instance, double time) {
    const State *state = &instance->state;
    double *usual = instance->scratch.usual;
    if (!instance->policy->remember) {
        return state->first_stage + N_COORDINATES;
    }
    const double span = time - state->usual_time;
    for (int i = 0; i < N_COORDINATES; i++) {
        usual[i] = state->usual[0][i] + span * (state->usual[1][i] + 0.5 * span * state->usual[2][i]);
    }
    return state->usual_known && fabs(span) * STABILISATION < STALE ? usual : NULL;
}

/* Is every constraint as clearly independent, or redundant, as the formula has it, and none about to be lost? Redundant
   rows may take the place of those that are weakened, which the formula does not know. */
static bool formula_holds(const Instance *instance, const double margins[], const double squares[]) {
    const IndependentRows *known = &instance->state.rows;
    const bool turns = !multipliers_unique(instance);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const double usual = instance->state.rows_known ? known->distance[k] : 0.0;
        if (!(margins[k] > 0.0) ||
            !(squares[k] >= (turns ? constraints_weakened(usual) : CLEARLY_INDEPENDENT * usual * usual))) {
            return false;
        }
    }
    return true;
}

/* unknowns[n + m] by the generated formula. Returns whether it holds there. Where all constraints are rows of contacts
   and none holds, there is none to be lost. */
static bool evaluate_formula(Instance *instance, double time, const double states[], const double inputs[],
                             const double drift[], double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pivots, N_COORDINATES);
    WORK(mark, double, margins, N_CONSTRAINTS);
    WORK(mark, double, squares, N_CONSTRAINTS);
    const bool free = contacts_idle(instance) == N_CONSTRAINTS;
    if (!free && contacts_hold(instance)) {
        return arena_leave(mark, false);
    }
    mechanism_accelerations(time, states, inputs, instance->state.parameters, drift, unknowns, pivots, margins,
                            squares);
    return arena_leave(mark, (free || formula_holds(instance, margins, squares)) && pivots_sound(instance, pivots));
}

bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[],
                      double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, drift, N_CONSTRAINTS);
    System *system = &instance->scratch.system;
    find_drift(instance, time, states, inputs, drift);
    if (!evaluate_formula(instance, time, states, inputs, drift, unknowns)) {
        WORK(mark, double, below, N_CONSTRAINTS);
        if (!system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
            return arena_leave(mark, false);
        }
        for (int k = 0; k < N_CONSTRAINTS; k++) {
            below[k] = -system->gamma[k] - drift[k];
        }
        system_solve(system, system->forcing, below, usual_accelerations(instance, time), unknowns);
        if (!contacts_slide(instance, system, time, states, inputs, unknowns)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, all_finite(unknowns, N_UNKNOWNS) || report_accelerations(instance, time, unknowns));
}

void accelerations_stabilise(const Instance *instance, double change[]) {
    const double rate = stabilisation(instance);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        change[N_COORDINATES + k] += 2.0 * rate * change[N_UNKNOWNS + k];
    }
    for (int k = 0; k < N_HOLONOMIC; k++) {
        change[N_COORDINATES + k] += rate * rate * change[N_UNKNOWNS + N_CONSTRAINTS + k];
    }
}

/* A start may be near a singular position: what is usual is the greatest so far. */
static void note_usual(const ConstraintFactorization *f, IndependentRows *known) {
    for (int k = 0; k < f->rows; k++) {
        const int row = f->order[k];
        const double distance = k < f->rank && known->distance[row] > 0.0 ? constraints_distance(f, k) : 0.0;
        known->distance[row] = fmax(known->distance[row], distance);
        known->slope[row] = fmax(known->slope[row], constraints_slope(f->jacobian, row));
    }
}

void constraints_remember(Instance *instance, const Motion *motion) {
    State *state = &instance->state;
    if (instance->cache.system.constraints.holding) {
        return;
    }
    note_usual(&instance->cache.system.constraints, &state->rows);
    for (int order = 0; order <= MAX_OUTPUT_ORDER; order++) {
        memcpy(state->usual[order], motion->q[2 + order], sizeof state->usual[order]);
        if (!all_finite(state->usual[order], N_COORDINATES)) {
            state->usual_known = 0;
            return;
        }
    }
    state->usual_known = 1;
    state->usual_time = state->time;
    instance_forget_motion(instance); /* so that the same values come out after a return to this State */
}
