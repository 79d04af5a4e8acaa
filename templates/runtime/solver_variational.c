/* Variational integrators: the principle of least action, discretised. The action over a step is a quadrature (b, c) of
   L along a polynomial of the coordinates; making it stationary gives for the velocities V_i at the stages

       dL/dqd (Q_i, V_i) = p + h sum_j hat_ij F_j,   Q_i = q + h sum_j a_ij V_j,   F = dL/dq - dR/dqd + Q,

   and q, p move on by h sum_j b_j V_j and h sum_j b_j F_j. With Gauss points these are the Gauss methods in q and p
   (a = hat), with Lobatto points the pairs IIIA and IIIB, of which the first is Stoermer and Verlet's. They keep the
   symplectic form, momenta of symmetries, and energy up to a bounded error. Forces enter as in the discrete principle of
   d'Alembert. Sources: Marsden, West, Discrete mechanics and variational integrators, Acta Numerica 2001, sections 2.6
   and 3.2; Hairer, Lubich, Wanner, Geometric Numerical Integration, 2nd edition, section VI.6.

   The equations are solved to rounding and the sums are compensated, so that rounding errors do not add up to a drift:
   Hairer, McLachlan, Razakarivony, Achieving Brouwer's law with implicit Runge-Kutta methods, BIT 48, 2008. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "solver_collocation.h"
#include "equations.h"
#include "finite.h"
#include "inputs.h"
#include "solver.h"
#include "system.h"

enum { N = N_COORDINATES, S = STAGES, MOST_ITERATIONS = 100 };

static const double CONVERGED = 1e-9; /* relative changes below this may come to rest at rounding */

/* The velocities at the stages, and from there coordinates, momenta dL/dqd and forces F. */
typedef struct {
    double velocities[S][N];
    double coordinates[S][N];
    double momenta[S][N];
    double forces[S][N];
} Stages;

static void evaluate(Instance *instance, double time, const double q[], const double qd[], double momenta[],
                     double forces[]) {
    double states[N_STATES];
    memcpy(states, q, N * sizeof(double));
    memcpy(states + N, qd, N * sizeof(double));
    mechanism_canonical(time, states, inputs_at(instance, time), instance->state.parameters, momenta, forces);
}

static double stage_time(const Instance *instance, Step step, int i) {
    return COLLOCATION.c[i] == 1.0 ? step.end : instance->state.time + COLLOCATION.c[i] * step.length;
}

/* sum_j weights[j] rows[j][i] */
static double weighed(const double weights[], double rows[][N], int i) {
    double sum = 0.0;
    for (int j = 0; j < S; j++) {
        sum += weights[j] * rows[j][i];
    }
    return sum;
}

/* Coordinates, momenta and forces that belong to the velocities. */
static void complete(Instance *instance, Step step, Stages *stages) {
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            stages->coordinates[i][k] =
                instance->state.states[k] + step.length * weighed(COLLOCATION.a + i * S, stages->velocities, k);
        }
        evaluate(instance, stage_time(instance, step, i), stages->coordinates[i], stages->velocities[i],
                 stages->momenta[i], stages->forces[i]);
    }
}

/* One round: each V_i is corrected by M^-1 times what its momentum misses, with M at the start of the step. Returns the
   greatest relative change. */
static double correct(Instance *instance, Step step, const double p[], Stages *stages) {
    double greatest = 0.0;
    for (int i = 0; i < S; i++) {
        double missing[N_COORDINATES];
        double change[N_COORDINATES];
        for (int k = 0; k < N; k++) {
            missing[k] = p[k] + step.length * weighed(COLLOCATION.hat + i * S, stages->forces, k) -
                         stages->momenta[i][k];
        }
        system_solve(&instance->scratch.system, missing, NULL, NULL, change);
        for (int k = 0; k < N; k++) {
            stages->velocities[i][k] += change[k];
            const double relative = fabs(change[k]) / (fabs(stages->velocities[i][k]) + NOMINAL_STATES[N + k]);
            greatest = isfinite(relative) ? fmax(greatest, relative) : HUGE_VAL;
        }
    }
    return greatest;
}

/* Iterates until the changes are rounding errors: until they do not fall any more. */
static bool solve_stages(Instance *instance, Step step, const double p[], Stages *stages) {
    double previous = HUGE_VAL;
    for (int i = 0; i < MOST_ITERATIONS; i++) {
        complete(instance, step, stages);
        const double change = correct(instance, step, p, stages);
        if (change == 0.0 || (change <= CONVERGED && change >= previous)) {
            complete(instance, step, stages);
            return true;
        }
        if (!(change < 1e3 * previous) || change == HUGE_VAL) {
            break;
        }
        previous = change;
    }
    return report_iteration(instance, step);
}

/* x + increment with the error of earlier sums in rest, which is brought up to date. */
static double add_compensated(double x, double increment, double *rest) {
    const double whole = increment + *rest;
    const double sum = x + whole;
    *rest = (x - sum) + whole;
    return sum;
}

/* The velocities whose momenta are p at the end of the step: M qd + a = p, corrected once for rounding. */
static bool velocities_of(Instance *instance, Step step, const double q[], const double p[], double qd[]) {
    System *system = &instance->scratch.system;
    double states[N_STATES];
    double momenta[N], forces[N], change[N_COORDINATES];
    memset(states, 0, sizeof states);
    memcpy(states, q, N * sizeof(double));
    if (!system_factorize(instance, step.end, states, inputs_at(instance, step.end), 0, 0.0, system)) {
        return false;
    }
    memset(qd, 0, N * sizeof(double));
    for (int round = 0; round < 2; round++) {
        evaluate(instance, step.end, q, qd, momenta, forces);
        for (int k = 0; k < N; k++) {
            momenta[k] = p[k] - momenta[k];
        }
        system_solve(system, momenta, NULL, NULL, change);
        for (int k = 0; k < N; k++) {
            qd[k] += change[k];
        }
    }
    return true;
}

/* The momenta at the present point: kept from the last step, or new if something was changed since. */
static void update_momenta(Instance *instance) {
    State *state = &instance->state;
    double forces[N];
    if (!state->canonical.valid) {
        memset(&state->canonical, 0, sizeof state->canonical);
        evaluate(instance, state->time, state->states, state->states + N, state->canonical.momenta, forces);
        state->canonical.valid = 1;
    }
}

/* A step of this method is never rejected: momenta and rests of sums go to the State at once. */
bool solver_step(Instance *instance, Step step) {
    State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    Canonical next;
    Stages stages;

    update_momenta(instance);
    next = state->canonical;
    if (!system_factorize(instance, state->time, state->states, inputs_at(instance, state->time), 0, 0.0,
                          &scratch->system)) {
        return false;
    }
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            stages.velocities[i][k] =
                state->states[N + k] + COLLOCATION.c[i] * step.length * state->first_stage[N + k];
        }
    }
    if (!solve_stages(instance, step, state->canonical.momenta, &stages)) {
        return false;
    }
    for (int k = 0; k < N; k++) {
        const double shift = step.length * weighed(COLLOCATION.b, stages.velocities, k);
        const double kick = step.length * weighed(COLLOCATION.b, stages.forces, k);
        scratch->new_states[k] = add_compensated(state->states[k], shift, &next.rest_coordinates[k]);
        next.momenta[k] = add_compensated(state->canonical.momenta[k], kick, &next.rest_momenta[k]);
    }
    if (!velocities_of(instance, step, scratch->new_states, next.momenta, scratch->new_states + N) ||
        !equations_derivative(instance, step.end, scratch->new_states, scratch->new_derivatives)) {
        return false;
    }
    if (!all_finite(scratch->new_states, N_STATES)) {
        return report_iteration(instance, step);
    }
    state->canonical = next;
    return true;
}

double solver_error(const Instance *instance, Step step, double tolerance, int *worst) {
    (void)instance;
    (void)step;
    (void)tolerance;
    *worst = 0;
    return 0.0; /* steps have a fixed length */
}

double solver_stiffness(const Instance *instance) {
    (void)instance;
    return 0.0; /* steps have a fixed length */
}

bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]) {
    (void)instance;
    (void)step;
    (void)terms;
    return true; /* there is no dense output */
}
