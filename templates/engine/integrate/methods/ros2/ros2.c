/* ROS2, a linearly implicit method of order 2 and fixed cost, for stiff mechanisms in real time:

       (I - g h J) k1 = f(t, x),  (I - g h J) k2 = f(t + h, x + h k1) - 2 k1,  x_new = x + h (3 k1 + k2) / 2

   with J = df/dx and g = 1 - 1/sqrt(2), which makes it L-stable. Its order does not depend on J, so that neither df/dt
   nor the exact J is needed. Verwer, Spee, Blom, Hundsdorfer, A second-order Rosenbrock method applied to photochemical
   dispersion problems, SIAM J. Sci. Comput. 20 (1999) 1456-1480.

   With k = [a, b], J = [0, I; P, V] and s = g h the system (I - s J) k = r is one of n rows for b:

       (I - s V - s^2 P) b = r_b + s P r_a,   a = r_a + s b

   Further states join the velocities: b then has their part too, and P no columns for it. A step takes two evaluations
   of the equations, at most N_STATES tangents (see COLOURS) and one factorisation, always.

   Without iteration J must hold over the whole step. Where a stiff direction turns in it, as that of a rod which is
   nearly rigid does, the stage leaves the slow motion by v^2 h^2 / 2 and is sent back along the direction of the start:
   the velocity gets an error of the order of k/m omega^4 h^4 a step, which L-stability does not damp. */
#include <math.h>
#include <string.h>

#include "derivative.h"
#include "fixed_steps.h"
#include "jacobian.h"
#include "lu.h"
#include "ros2.h"
#include "step_failure.h"

const Method METHOD = {.name = "ros2", .order = 2, .damps = true};

/* What the linearization may miss of the velocities in a step, all in nominal units: PART of their change in the step,
   and SMALL of the velocities themselves. Beyond the sum the step is too long for the equations. */
static const double PART = 0.03, SMALL = 3e-6;

/* matrix = I - s V - s^2 P, row-major. */
static void assemble(const double jacobian[], double s, double matrix[]) {
    for (int i = 0; i < R; i++) {
        for (int j = 0; j < R; j++) {
            const double p = j < N ? jacobian[j * R + i] : 0.0, v = jacobian[(N + j) * R + i];
            matrix[i * R + j] = (i == j ? 1.0 : 0.0) - s * (v + s * p);
        }
    }
}

void ros2_solve(Arena *arena, const SolverScratch *work, double h, double r[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, b, R);
    const double s = GAMMA * h;
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < R; i++) {
            r[N + i] += s * work->jacobian[j * R + i] * r[j];
        }
    }
    lu_solve(work->matrix, work->rows, R, r + N, b);
    memcpy(r + N, b, R * sizeof(double));
    for (int i = 0; i < N; i++) {
        r[i] += s * r[N + i];
    }
    arena_release(mark);
}

/* By how much the accelerations and the derivatives of further states at the new states exceed those at the second
   stage, f2, beyond what J tells of the difference. Both are at the end of the step, so that what moves with time has
   no part in it. */
static double beyond_linear(const Scratch *scratch, const double f2[], int i) {
    double rest = scratch->new_derivatives[N + i] - f2[i];
    for (int j = 0; j < N_STATES; j++) {
        rest -= scratch->solver.jacobian[j * R + i] * (scratch->new_states[j] - scratch->stage_states[j]);
    }
    return rest;
}

/* Compares what beyond_linear changes the velocities by in a step with their whole change; maxima in nominal units. */
static void compare_with_linearization(Instance *instance, Step step, const double f2[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, rest, R);
    WORK(mark, double, answer, R);
    Scratch *scratch = &instance->scratch;
    const double *x = instance->state.states, *x_new = scratch->new_states;
    double missed = 0.0, change = 0.0, size = 1.0;
    for (int i = 0; i < R; i++) {
        rest[i] = beyond_linear(scratch, f2, i);
    }
    lu_solve(scratch->solver.matrix, scratch->solver.rows, R, rest, answer);
    for (int i = 0; i < R; i++) {
        missed = fmax(missed, fabs(step.length * answer[i]) / NOMINAL_STATES[N + i]);
        change = fmax(change, fabs(x_new[N + i] - x[N + i]) / NOMINAL_STATES[N + i]);
        size = fmax(size, fabs(x_new[N + i]) / NOMINAL_STATES[N + i]);
    }
    scratch->solver.missed = missed / (PART * change + SMALL * size);
    arena_release(mark);
}

bool ros2_stages(Instance *instance, Step step, double f2[]) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    double *k1 = scratch->solver.stages[0], *k2 = scratch->solver.stages[1];
    if (!equations_jacobian(instance, state->time, state->states, scratch->solver.jacobian)) {
        return false;
    }
    assemble(scratch->solver.jacobian, GAMMA * step.length, scratch->solver.matrix);
    if (!lu_factorize(scratch->solver.matrix, scratch->solver.rows, R)) {
        return report_iteration(instance, step);
    }
    memcpy(k1, state->first_stage, sizeof state->first_stage);
    ros2_solve(instance->arena, &scratch->solver, step.length, k1);
    for (int i = 0; i < N_STATES; i++) {
        scratch->stage_states[i] = state->states[i] + step.length * k1[i];
    }
    if (!derivative_at(instance, step.end, scratch->stage_states, f2)) {
        return false;
    }
    for (int i = 0; i < N_STATES; i++) {
        k2[i] = f2[i] - 2.0 * k1[i];
    }
    ros2_solve(instance->arena, &scratch->solver, step.length, k2);
    return true;
}

bool solver_step(Instance *instance, Step step) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, f2, N_STATES);
    Scratch *scratch = &instance->scratch;
    const double *k1 = scratch->solver.stages[0], *k2 = scratch->solver.stages[1];
    if (!ros2_stages(instance, step, f2)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_states[i] = instance->state.states[i] + 0.5 * step.length * (3.0 * k1[i] + k2[i]);
    }
    if (!new_states_finite(instance, step) ||
        !derivative_at(instance, step.end, scratch->new_states, scratch->new_derivatives)) {
        return arena_leave(mark, false);
    }
    compare_with_linearization(instance, step, f2 + N);
    return arena_leave(mark, true);
}

double solver_stiffness(const Instance *instance) {
    return instance->scratch.solver.missed;
}
