/* Radau IIA of order 5 for stiff mechanisms, with the accelerations A_i at the stages as unknowns:

       V_i = qd + h sum_j a_ij A_j,   Q_i = q + c_i h qd + h^2 sum_j (a a)_ij A_j,   A_i = qdd(t + c_i h, Q_i, V_i).

   Simplified Newton iterations solve with I - h a x D - h^2 (a a) x K, where K = dqdd/dq and D = dqdd/dqd come from the
   tangent program and are kept as long as the iterations contract well. In the modes of a that are n real and n complex
   equations, here as 2 n real ones: half as many as those of the equations of first order. Further states z_i are
   solved for in the same way: their derivatives stand behind the accelerations, and z beside V. Source: [HW] Hairer,
   Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.8, with the error estimates of the code
   radau5.f of the same authors.

   With constraints qdd is solved for along with the multipliers at every stage, and the new states are moved onto the
   constraints, [HW] section VII.2. The stabilised index-2 system of Gear, Gupta and Leimkuhler (SIAM J. Sci. Stat.
   Comput. 6, 1985), where all stages meet the constraints, was tried: in steps of the same length its errors are 7 to
   30 times as large for plane linkages, half as large at best, and no smaller where a member is stiff. */
#include <math.h>
#include <string.h>

#include "collocation.h"
#include "constraints.h"
#include "derivative.h"
#include "inputs.h"
#include "radau_stages.h"
#include "scale.h"
#include "settings.h"
#include "solver.h"

static const double SQRT6 = 2.449489742783178;

/* The tolerance that steps and iterations are measured with. Where steps resolve the motion, the error of the solution
   is proportional to h^5 and the first estimate to h^4, hence the error to the power 5/4 of the estimate; so it follows
   the tolerance asked for. (radau5.f takes 0.1 tolerance^(2/3).) Where steps pass over fast decays, the error is
   proportional to the first estimate itself. There the second estimate is about as large as the first one, and
   elsewhere it is proportional to h^5: it has to meet the tolerance asked for. */
double radau_inner_tolerance(double tolerance) {
    return 0.3 * pow(tolerance, 0.8);
}

/* errors[0] = (I - g J)^-1 g (derivatives + sum_i e_i z_i / h), errors[1] = (I - g J)^-1 g J errors[0]. */
void radau_errors(const Instance *instance, double h, const double x[], const double derivatives[],
                  const double accelerations[], double errors[][N_STATES]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, combined, N_STATES);
    WORK(mark, double, states, N_STATES);
    const double e[3] = {-(13.0 + 7.0 * SQRT6) / 3.0, (-13.0 + 7.0 * SQRT6) / 3.0, -1.0 / 3.0};
    for (int i = 0; i < S; i++) {
        radau_stage(x, h, i, accelerations, states);
        for (int k = 0; k < N_STATES; k++) {
            combined[k] += e[i] * (states[k] - x[k]);
        }
    }
    for (int k = 0; k < N_STATES; k++) {
        errors[0][k] = MODES.real * (h * derivatives[k] + combined[k]);
    }
    radau_filter(instance, h, errors[0]);
    memcpy(errors[1], errors[0], sizeof errors[1]);
    radau_filter(instance, h, errors[1]);
    for (int k = 0; k < N_STATES; k++) {
        errors[1][k] -= errors[0][k];
    }
    arena_release(mark);
}

double solver_error(const Instance *instance, Step step, double tolerance, int *worst) {
    const Scratch *scratch = &instance->scratch;
    const double by_inner = 1.0 / radau_inner_tolerance(tolerance), by_tolerance = 1.0 / tolerance;
    double largest = 0.0;
    (void)step;
    *worst = 0;
    for (int i = 0; i < N_STATES; i++) {
        const double old = fabs(instance->state.states[i]), next = fabs(scratch->new_states[i]);
        const double first = fabs(scratch->solver.errors[0][i]) * by_inner;
        const double second = fabs(scratch->solver.errors[1][i]) * by_tolerance;
        const double error = (first > second ? first : second) / ((old > next ? old : next) + NOMINAL_STATES[i]);
        if (!(error <= largest)) {
            largest = error;
            *worst = i;
        }
    }
    return largest;
}

/* With the derivatives at the start or, where the error is too large, at the start moved by it: [HW] (8.19), (8.20). */
static bool estimate(Instance *instance, Step step, const double accelerations[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, derivatives, N_STATES);
    double (*errors)[N_STATES] = instance->scratch.solver.errors;
    const double *x = instance->state.states;
    int worst;
    radau_errors(instance, step.length, x, instance->state.first_stage, accelerations, errors);
    if (solver_error(instance, step, solver_tolerance(&instance->state), &worst) <= 1.0) {
        return arena_leave(mark, true);
    }
    for (int k = 0; k < N_STATES; k++) {
        states[k] = x[k] + errors[0][k];
    }
    if (!derivative_at(instance, instance->state.time, states, derivatives)) {
        return arena_leave(mark, false);
    }
    radau_errors(instance, step.length, x, derivatives, accelerations, errors);
    return arena_leave(mark, true);
}

bool solver_step(Instance *instance, Step step) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, accelerations, (int)S * R);
    Scratch *scratch = &instance->scratch;
    SolverMemory *memory = &instance->state.solver;
    bool moved;
    if (!radau_solve(instance, step, radau_inner_tolerance(solver_tolerance(&instance->state)), accelerations)) {
        return arena_leave(mark, false);
    }
    radau_stage(instance->state.states, step.length, S - 1, accelerations, scratch->new_states);
    if (!constraints_project(instance, step.end, inputs_at(instance, step.end), scratch->new_states, &moved) ||
        !estimate(instance, step, accelerations) ||
        !derivative_at(instance, step.end, scratch->new_states, scratch->new_derivatives)) {
        return arena_leave(mark, false);
    }
    memory->start = instance->state.time;
    memory->end = step.end;
    memory->length = step.length;
    memcpy(memory->accelerations, accelerations, sizeof memory->accelerations);
    memcpy(memory->start_accelerations, instance->state.first_stage + N, sizeof memory->start_accelerations);
    memcpy(memory->end_accelerations, scratch->new_derivatives + N, sizeof memory->end_accelerations);
    return arena_leave(mark, true);
}

double solver_stiffness(const Instance *instance) {
    (void)instance;
    return 0.0; /* L-stable */
}

/* The accelerations[r] at the start of the last step, for its interpolant: of the polynomial through the stages, moved
   by what the equations say beyond it. Stiff parts of that are errors of the states, or a transient that the step leaps
   over, times the stiffness, and would bend the states between ends that are right: by 9 m/s after a force on a stiff
   damper had jumped. They are filtered as in the error estimate, by 1 - (1 - filter)^2, which spares the others. */
static void smooth_start(const Instance *instance, double h, double accelerations[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, beyond, N_STATES);
    WORK_ZEROS(mark, double, again, N_STATES);
    radau_polynomial(&instance->state.solver, 0.0, accelerations);
    for (int k = 0; k < R; k++) {
        beyond[N + k] = instance->state.first_stage[N + k] - accelerations[k];
    }
    radau_filter(instance, h, beyond);
    memcpy(again + N, beyond + N, R * sizeof(double));
    radau_filter(instance, h, again);
    for (int k = 0; k < R; k++) {
        accelerations[k] += 2.0 * beyond[N + k] - again[N + k];
    }
    arena_release(mark);
}

/* The interpolant of further states: the quartic whose derivatives are before[r] at the start and those at the stages.
   It meets both ends, because Radau's quadrature is exact for its derivative. */
static void dense_further(const Instance *instance, double h, const double before[],
                          double terms[DENSE_TERMS][N_STATES]) {
    const double *stages = instance->state.solver.accelerations;
    const double x = COLLOCATION.c[0], y = 1.0 - x;
    for (int k = N; k < R; k++) {
        const double rise = terms[0][N + k], start = h * before[k] - rise;
        const double end = rise - h * stages[(S - 1) * R + k] - start;
        const double cubic = rise + (y - x) * start + x * (2.0 * y - x) * end; /* times h: its derivative at x */
        terms[1][N + k] = start;
        terms[2][N + k] = end;
        terms[HERMITE_TERMS][N + k] = (h * stages[k] - cubic) / (2.0 * x * y * (y - x));
        terms[HERMITE_TERMS + 1][N + k] = 0.0;
    }
}

/* The sum of differences of a coordinate x between the ends of a step; 0 where it is no more than their rounding. */
static double beyond_rounding(double sum, double x) {
    return fabs(sum) > NOISE * fabs(x) ? sum : 0.0;
}

/* Hermite's quintic for the coordinates, which meets their accelerations at both ends too (smooth_start and those of
   the last stage), and its derivative for the velocities. It is as smooth as the motion and needs no evaluation; the
   polynomial through the stages has order 3. A velocity is the rounding of its coordinate over h where h is tiny, so
   that rounding is left out. */
bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, R);
    const double h = step.length, *after = instance->state.solver.accelerations + (S - 1) * R;
    double *fourth = terms[HERMITE_TERMS], *fifth = terms[HERMITE_TERMS + 1];
    smooth_start(instance, h, before);
    for (int k = 0; k < N; k++) {
        fourth[k] = 0.5 * h * h * before[k] + terms[1][k] - terms[2][k];
        fifth[k] = beyond_rounding(0.5 * h * h * (after[k] - before[k]) + 3.0 * terms[2][k], instance->state.states[k]);
        terms[1][N + k] = h * before[k] - terms[0][N + k];
        terms[2][N + k] = terms[0][N + k] - h * after[k] - terms[1][N + k];
        fourth[N + k] = 5.0 * fifth[k] / h;
        fifth[N + k] = 0.0;
    }
    dense_further(instance, h, before, terms);
    return arena_leave(mark, true);
}
