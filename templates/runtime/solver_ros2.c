/* ROS2, a linearly implicit method of order 2 and fixed cost, for stiff mechanisms in real time:

       (I - g h J) k1 = f(t, x),  (I - g h J) k2 = f(t + h, x + h k1) - 2 k1,  x_new = x + h (3 k1 + k2) / 2

   with J = df/dx and g = 1 - 1/sqrt(2), which makes it L-stable. Its order does not depend on J, so that neither df/dt
   nor the exact J is needed. Verwer, Spee, Blom, Hundsdorfer, A second-order Rosenbrock method applied to photochemical
   dispersion problems, SIAM J. Sci. Comput. 20 (1999) 1456-1480.

   With k = [a, b], J = [0, I; P, V] and s = g h the system (I - s J) k = r is one of n rows for b:

       (I - s V - s^2 P) b = r_b + s P r_a,   a = r_a + s b

   A step takes two evaluations of the equations, at most 2n tangents (see COLOURS) and one factorisation, always. */
#include <math.h>
#include <string.h>

#include "equations.h"
#include "solver.h"
#include "solver_lu.h"

const Method METHOD = {"ros2", 2, 0, 0};

enum { N = N_COORDINATES };

static const double GAMMA = 0.2928932188134524755991556; /* 1 - 1/sqrt(2) */

/* matrix = I - s V - s^2 P, row-major. */
static void assemble(const double jacobian[], double s, double matrix[]) {
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            const double p = jacobian[j * N + i], v = jacobian[(N + j) * N + i];
            matrix[i * N + j] = (i == j ? 1.0 : 0.0) - s * (v + s * p);
        }
    }
}

/* Overwrites r[2n] by the solution k of (I - s J) k = r. */
static void solve_stage(const double jacobian[], const double matrix[], const int rows[], double s, double r[]) {
    double b[N];
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < N; i++) {
            r[N + i] += s * jacobian[j * N + i] * r[j];
        }
    }
    lu_solve(matrix, rows, N, r + N, b);
    memcpy(r + N, b, sizeof b);
    for (int i = 0; i < N; i++) {
        r[i] += s * r[N + i];
    }
}

bool solver_step(Instance *instance, Step step) {
    const State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    double *k1 = scratch->stages[0], *k2 = scratch->stages[1];
    const double s = GAMMA * step.length;
    int rows[N_COORDINATES];

    if (!equations_jacobian(instance, state->time, state->states, scratch->jacobian)) {
        return false;
    }
    assemble(scratch->jacobian, s, scratch->matrix);
    if (!lu_factorize(scratch->matrix, rows, N)) {
        return report_iteration(instance, step);
    }
    memcpy(k1, state->first_stage, sizeof state->first_stage);
    solve_stage(scratch->jacobian, scratch->matrix, rows, s, k1);
    for (int i = 0; i < N_STATES; i++) {
        scratch->stage_states[i] = state->states[i] + step.length * k1[i];
    }
    if (!equations_derivative(instance, step.end, scratch->stage_states, k2)) {
        return false;
    }
    for (int i = 0; i < N_STATES; i++) {
        k2[i] -= 2.0 * k1[i];
    }
    solve_stage(scratch->jacobian, scratch->matrix, rows, s, k2);
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_states[i] = state->states[i] + 0.5 * step.length * (3.0 * k1[i] + k2[i]);
    }
    return new_states_finite(instance, step) &&
           equations_derivative(instance, step.end, scratch->new_states, scratch->new_derivatives);
}

/* Steps of fixed length need neither of these. */
double solver_error(const Instance *instance, Step step, double tolerance, int *worst) {
    (void)instance;
    (void)step;
    (void)tolerance;
    *worst = 0;
    return 0.0;
}

double solver_stiffness(const Instance *instance) {
    (void)instance;
    return 0.0; /* L-stable */
}

bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]) {
    (void)instance;
    (void)step;
    (void)terms;
    return false;
}
