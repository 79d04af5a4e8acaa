/* Evaluating the generated functions of mechanism.h, at the present point and at the stages of the solver.

   The generated code solves M qdd = f without pivoting, in an order that suits the mechanism, and reports its pivots.
   Where one of them is no better than rounding error, the dense solver of linear_solve.h takes over. With constraints
   it likewise gives accelerations and multipliers in one formula, as long as the same constraints are independent as
   at the start, and clearly so; else see system.h. */
#include "equations.h"

#include <math.h>
#include <string.h>

#include "finite.h"
#include "inputs.h"
#include "system.h"
#if N_CONSTRAINTS > 0
#include "constraint_projection.h"
#endif
#if N_MASSLESS > 0
#include "massless.h"
#endif

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

/* In model exchange the importer's solver lets the constraints drift; their accelerations then are aimed at

       d2phi/dt2 = -2 s dphi/dt - s^2 phi,   s = STABILISATION,

   which brings phi back. Co-simulation projects instead. Ascher, Chin, Reich, Stabilization of DAEs and invariant
   manifolds, Numerische Mathematik 67, 1994. */
static double stabilisation(const Instance *instance) {
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

/* Is every constraint as clearly independent, or redundant, as the formula takes it to be, and none about to be lost? */
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

/* qdd[n] and the multipliers behind it at the given time, states and inputs. */
static bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[],
                             double unknowns[]) {
    System *system = &instance->scratch.system;
    double drift[N_CONSTRAINTS], pivots[N_COORDINATES], margins[N_CONSTRAINTS], squares[N_CONSTRAINTS];
    find_drift(instance, time, states, inputs, drift);
    mechanism_accelerations(time, states, inputs, instance->state.parameters, drift, unknowns, pivots, margins, squares);
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

/* Multipliers of redundant constraints are not unique; shown is the solution of least norm. */
static void spread(const System *system, double unknowns[]) {
    constraints_spread(&system->constraints, unknowns + N_COORDINATES);
}

static bool multipliers_unique(const Instance *instance) {
    return instance->state.rows_known && instance->state.rows.rank == N_CONSTRAINTS;
}

#else

static void spread(const System *system, double unknowns[]) {
    (void)system;
    (void)unknowns;
}

static bool multipliers_unique(const Instance *instance) {
    (void)instance;
    return true;
}

/* qdd[n] at the given time, states and inputs. */
static bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[],
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

bool equations_derivative(Instance *instance, double time, const double states[], double derivatives[]) {
    double unknowns[N_UNKNOWNS];
    if (!accelerations_at(instance, time, states, inputs_at(instance, time), unknowns)) {
        return false; /* with nothing written that was not calculated: derivatives may belong to the State */
    }
    memcpy(derivatives, states + N_COORDINATES, N_COORDINATES * sizeof(double));
    memcpy(derivatives + N_COORDINATES, unknowns, N_COORDINATES * sizeof(double));
    return true;
}

/* unknowns = - K^-1 change, with a factorisation of the matrix K of the system. */
static void solve_for_change(const System *system, double change[], double unknowns[]) {
    for (int i = 0; i < N_UNKNOWNS; i++) {
        change[i] = -change[i];
    }
    system_solve(system, change, change + N_COORDINATES, NULL, unknowns);
}

#if IMPLICIT

/* Columns whose rows do not meet are one colour and share a seed: COLOURS[colour][i] is the one that has an entry in
   row i, -1 if none has. Curtis, Powell, Reid, On the estimation of sparse Jacobian matrices, IMA Journal of Applied
   Mathematics 13, 1974. */
bool equations_jacobian(Instance *instance, double time, const double states[], double jacobian[]) {
    static const double NO_INPUTS[N_INPUTS], NO_PARAMETERS[SIZE_PARAMETERS];
    const double *inputs = inputs_at(instance, time), *parameters = instance->state.parameters;
    System *system = &instance->scratch.system;
    double unknowns[N_UNKNOWNS], changed[N_UNKNOWNS], change[N_RESIDUALS];
    if (!accelerations_at(instance, time, states, inputs, unknowns) ||
        !system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
        return false;
    }
    memset(jacobian, 0, SIZE_JACOBIAN * sizeof(double));
    for (int colour = 0; colour < N_COLOURS; colour++) {
        const int *column = COLOURS[colour];
        double seed[N_STATES] = {0.0};
        for (int i = 0; i < N_COORDINATES; i++) {
            if (column[i] >= 0) {
                seed[column[i]] = 1.0;
            }
        }
        mechanism_residual_tangent(time, states, inputs, parameters, unknowns, 0.0, seed, NO_INPUTS, NO_PARAMETERS,
                                   change);
        solve_for_change(system, change, changed);
        for (int i = 0; i < N_COORDINATES; i++) {
            if (column[i] >= 0) {
                jacobian[column[i] * N_COORDINATES + i] = changed[i];
            }
        }
    }
    return true;
}

#endif

bool equations_settle(Instance *instance) {
#if N_CONSTRAINTS > 0
    if (instance->state.mode == MODE_INITIALIZATION) {
        return constraints_settle(instance);
    }
#else
    (void)instance;
#endif
    return true;
}

void equations_dependent(Instance *instance) {
    if (!instance->cache.dependent_valid) {
        mechanism_dependent(instance->state.parameters, instance->cache.dependent);
        instance->cache.dependent_valid = true;
    }
}

bool equations_massless(Instance *instance) {
#if N_MASSLESS > 0
    const bool started = instance->state.mode != MODE_INSTANTIATED && instance->state.mode != MODE_INITIALIZATION;
    return instance->type == fmi2CoSimulation || !started || massless_settle(instance);
#else
    (void)instance;
    return true;
#endif
}

/* Brings the factorisation at the present point up to date; it serves all seeds. */
static bool update_system(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->system_valid) {
        cache->system_valid = system_factorize(instance, state->time, state->states, state->inputs, N_CONSTRAINTS, 0.0,
                                               &cache->system);
    }
    return cache->system_valid;
}

bool equations_accelerations(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!equations_massless(instance)) {
        return false;
    }
    if (!cache->accelerations_valid) {
        const bool unique = multipliers_unique(instance);
        cache->accelerations_valid =
            accelerations_at(instance, state->time, state->states, state->inputs, cache->accelerations) &&
            (unique || update_system(instance));
        memcpy(cache->reported, cache->accelerations, sizeof cache->reported);
        if (cache->accelerations_valid && !unique) {
            spread(&cache->system, cache->reported);
        }
    }
    return cache->accelerations_valid;
}

#if N_CONSTRAINTS > 0
void equations_remember(Instance *instance) {
    State *state = &instance->state;
    Motion motion;
    if (!equations_motion(instance, MAX_OUTPUT_ORDER, &motion) || instance->cache.system.constraints.holding) {
        return; /* there they would be those remembered so far */
    }
    for (int order = 0; order <= MAX_OUTPUT_ORDER; order++) {
        memcpy(state->usual[order], motion.q[2 + order], sizeof state->usual[order]);
        if (!all_finite(state->usual[order], N_COORDINATES)) {
            state->usual_known = 0;
            return;
        }
    }
    state->usual_known = 1;
    state->usual_time = state->time;
    instance_forget_motion(instance); /* what is calculated again has to be the same after going back to this State */
}
#endif

bool equations_locals(Instance *instance) {
    Cache *cache = &instance->cache;
    const State *state = &instance->state;
    if (!cache->locals_valid && equations_accelerations(instance)) {
        mechanism_locals(state->time, state->states, state->inputs, state->parameters, cache->reported,
                         cache->locals);
        cache->locals_valid = true;
    }
    return cache->locals_valid;
}

bool equations_settle_seed(Instance *instance, Seed *seed) {
#if N_CONSTRAINTS > 0
    if (instance->state.mode == MODE_INITIALIZATION) {
        return constraints_settle_seed(instance, seed);
    }
#endif
#if N_MASSLESS > 0
    return massless_settle_seed(instance, seed);
#else
    (void)instance;
    (void)seed;
#endif
    return true;
}

void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent) {
    mechanism_dependent_tangent(instance->state.parameters, seed->parameters, tangent->dependent);
}

/* With r = M qdd - f = 0 the accelerations change by dqdd = -M^-1 dr, where dr is the derivative of r along the seed
   with qdd held fixed; with constraints likewise for all unknowns. */
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent) {
    const State *state = &instance->state;
    Cache *cache = &instance->cache;
    double change[N_RESIDUALS];
    if (!equations_accelerations(instance) || !update_system(instance)) {
        return false;
    }
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                               seed->time, seed->states, seed->inputs, seed->parameters, change);
#if N_CONSTRAINTS > 0
    const double rate = stabilisation(instance);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        change[N_COORDINATES + k] += 2.0 * rate * change[N_UNKNOWNS + k];
    }
    for (int k = 0; k < N_HOLONOMIC; k++) {
        change[N_COORDINATES + k] += rate * rate * change[N_UNKNOWNS + N_CONSTRAINTS + k];
    }
#endif
    solve_for_change(&cache->system, change, tangent->accelerations);
    spread(&cache->system, tangent->accelerations);
    mechanism_locals_tangent(state->time, state->states, state->inputs, state->parameters, cache->reported,
                             seed->time, seed->states, seed->inputs, seed->parameters, tangent->accelerations,
                             tangent->locals);
    return true;
}

/* Differentiating r = 0 twice along the motion gives d4q = -M^-1 d2r, where d2r is the second derivative at d4q = 0. */
bool equations_motion(Instance *instance, int order, Motion *motion) {
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    const double *du = state->input_derivatives[0], *d2u = state->input_derivatives[1];
    double change[N_UNKNOWNS];
    memcpy(motion->q[0], state->states, N_COORDINATES * sizeof(double));
    memcpy(motion->q[1], state->states + N_COORDINATES, N_COORDINATES * sizeof(double));
    if (order >= 0) {
        if (!equations_accelerations(instance)) {
            return false;
        }
        memcpy(motion->q[2], cache->accelerations, sizeof cache->accelerations);
    }
    if (order >= 1) {
        Seed seed = {.time = 1.0};
        Tangent tangent;
        memcpy(seed.states, motion->q[1], N_COORDINATES * sizeof(double));
        memcpy(seed.states + N_COORDINATES, motion->q[2], N_COORDINATES * sizeof(double));
        memcpy(seed.inputs, du, sizeof seed.inputs);
        if (!equations_tangent(instance, &seed, &tangent)) {
            return false;
        }
        memcpy(motion->q[3], tangent.accelerations, sizeof tangent.accelerations);
        memcpy(motion->locals[0], tangent.locals, sizeof tangent.locals);
    }
    if (order >= 2) {
        mechanism_residual_second(state->time, state->states, state->inputs, state->parameters, cache->accelerations,
                                  du, d2u, motion->q[3], change);
        solve_for_change(&cache->system, change, motion->q[4]);
        mechanism_locals_second(state->time, state->states, state->inputs, state->parameters, cache->reported,
                                du, d2u, motion->q[3], motion->q[4], motion->locals[1]);
    }
    return true;
}
