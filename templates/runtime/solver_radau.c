/* Radau IIA of order 5 for stiff mechanisms, with the accelerations A_i at the stages as unknowns:

       V_i = qd + h sum_j a_ij A_j,   Q_i = q + c_i h qd + h^2 sum_j (a a)_ij A_j,   A_i = qdd(t + c_i h, Q_i, V_i).

   Simplified Newton iterations solve with I - h a x D - h^2 (a a) x K, where K = dqdd/dq and D = dqdd/dqd come from the
   tangent program and are kept as long as the iterations contract well. In the modes of a that are n real and n complex
   equations, here as 2 n real ones: half as many as those of the equations of first order. Source: Hairer, Wanner,
   Solving Ordinary Differential Equations II, 2nd edition, section IV.8, with the error estimates of the code radau5.f
   of the same authors. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "solver_collocation.h"
#include "solver_lu.h"
#include "equations.h"
#include "finite.h"
#include "inputs.h"
#include "integrator.h"
#include "solver.h"
#if N_CONSTRAINTS > 0
#include "constraint_projection.h"
#endif

enum { N = N_COORDINATES, S = STAGES, SIZE = S * N, MOST_ITERATIONS = 10 };

static const double SQRT6 = 2.449489742783178;

static const double MOST_GROWTH = 4.0; /* of the second change beyond the first one, to go on with the iterations */
static const double KEEP = 0.02; /* iterations that contract by less go on with the same K and D in the next step */

/* The tolerance that steps are measured with. The error of the solution is proportional to h^5 and the estimate to h^4,
   hence to the power 5/4 of this one; so it follows the tolerance asked for. (radau5.f takes 0.1 tolerance^(2/3).) */
static double inner_tolerance(double tolerance) {
    return 0.3 * pow(tolerance, 0.8);
}

/* (a a)_ij */
static double squared(int i, int j) {
    double sum = 0.0;
    for (int k = 0; k < S; k++) {
        sum += COLLOCATION.a[i * S + k] * COLLOCATION.a[k * S + j];
    }
    return sum;
}

/* matrix = I - h b x D - h^2 (b b) x K for a block b of the modes (size x size), factorised. */
static bool factorize_block(const Memory *memory, double h, const double b[], int size, double matrix[], int rows[]) {
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < size; j++) {
            double square = 0.0;
            for (int k = 0; k < size; k++) {
                square += b[i * size + k] * b[k * size + j];
            }
            for (int k = 0; k < N; k++) {
                for (int l = 0; l < N; l++) {
                    matrix[(i * N + k) * size * N + j * N + l] = (i == j && k == l ? 1.0 : 0.0) -
                        h * b[i * size + j] * memory->damping[k * N + l] - h * h * square * memory->stiffness[k * N + l];
                }
            }
        }
    }
    return lu_factorize(matrix, rows, size * N);
}

/* K and D at the present point. */
static bool linearize(Instance *instance) {
    Memory *memory = &instance->state.memory;
    const double *jacobian = instance->scratch.jacobian;
    memory->linearized = 0;
    if (!equations_jacobian(instance, instance->state.time, instance->state.states, instance->scratch.jacobian)) {
        return false;
    }
    for (int k = 0; k < N; k++) {
        for (int l = 0; l < N; l++) {
            memory->stiffness[k * N + l] = jacobian[l * N + k];
            memory->damping[k * N + l] = jacobian[(N + l) * N + k];
        }
    }
    memory->linearized = 1;
    return true;
}

/* The factors of the systems for this length of step. */
static bool factorize(Instance *instance, Step step) {
    const Memory *memory = &instance->state.memory;
    Implicit *work = &instance->scratch.implicit;
    return (factorize_block(memory, step.length, &MODES.real, 1, work->real_matrix, work->real_rows) &&
            factorize_block(memory, step.length, MODES.pair, 2, work->pair_matrix, work->pair_rows)) ||
           report_iteration(instance, step);
}

/* result[S * N] = matrix x I . stages */
static void combine_stages(const double matrix[], const double stages[], double result[]) {
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            double sum = 0.0;
            for (int j = 0; j < S; j++) {
                sum += matrix[i * S + j] * stages[j * N + k];
            }
            result[i * N + k] = sum;
        }
    }
}

/* The change of the accelerations at the stages that the linearized equations ask for. */
static void solve_linearized(const Implicit *work, const double residual[], double change[]) {
    double modes[SIZE], solved[SIZE];
    combine_stages(MODES.to_modes, residual, modes);
    lu_solve(work->real_matrix, work->real_rows, N, modes, solved);
    lu_solve(work->pair_matrix, work->pair_rows, 2 * N, modes + N, solved + N);
    combine_stages(MODES.from_modes, solved, change);
}

/* The states at stage i for the accelerations. */
static void stage_states(const Instance *instance, double h, int i, const double accelerations[], double states[]) {
    const double *x = instance->state.states;
    for (int k = 0; k < N; k++) {
        double first = 0.0, second = 0.0;
        for (int j = 0; j < S; j++) {
            first += COLLOCATION.a[i * S + j] * accelerations[j * N + k];
            second += squared(i, j) * accelerations[j * N + k];
        }
        states[k] = x[k] + h * (COLLOCATION.c[i] * x[N + k] + h * second);
        states[N + k] = x[N + k] + h * first;
    }
}

/* residual[S * N] = qdd at the stages less the accelerations that led there. */
static bool residuals(Instance *instance, Step step, const double accelerations[], double residual[]) {
    double states[N_STATES], derivatives[N_STATES];
    for (int i = 0; i < S; i++) {
        const double time = COLLOCATION.c[i] == 1.0 ? step.end : instance->state.time + COLLOCATION.c[i] * step.length;
        stage_states(instance, step.length, i, accelerations, states);
        if (!equations_derivative(instance, time, states, derivatives)) {
            return false;
        }
        for (int k = 0; k < N; k++) {
            residual[i * N + k] = derivatives[N + k] - accelerations[i * N + k];
        }
    }
    return true;
}

/* What a change of the accelerations changes in the states, in units of the tolerance. */
static double size_of(const Instance *instance, double h, double tolerance, const double change[]) {
    double greatest = 0.0;
    for (int i = 0; i < SIZE; i++) {
        const double *x = instance->state.states + i % N, *nominal = NOMINAL_STATES + i % N;
        greatest = fmax(greatest, fabs(h * change[i]) / (tolerance * (fabs(x[N]) + nominal[N])));
        greatest = fmax(greatest, fabs(h * h * change[i]) / (tolerance * (fabs(x[0]) + nominal[0])));
    }
    return all_finite(change, SIZE) ? greatest : HUGE_VAL;
}

/* The values of the polynomials that are 1 at one stage and 0 at the others, x being the part of the step. */
static void weigh_stages(double x, double weights[]) {
    for (int j = 0; j < S; j++) {
        weights[j] = 1.0;
        for (int k = 0; k < S; k++) {
            weights[j] *= k == j ? 1.0 : (x - COLLOCATION.c[k]) / (COLLOCATION.c[j] - COLLOCATION.c[k]);
        }
    }
}

/* accelerations[n] at this part of the last step that was solved, of their polynomial; 0 if there was none. */
static void continue_last(const Memory *memory, double x, double accelerations[]) {
    double weights[S];
    weigh_stages(x, weights);
    for (int k = 0; k < N; k++) {
        accelerations[k] = 0.0;
        for (int j = 0; j < S && memory->length > 0.0; j++) {
            accelerations[k] += weights[j] * memory->accelerations[j * N + k];
        }
    }
}

/* Where the iterations begin: the polynomial through the accelerations of the last step that was solved, continued, and
   moved by what was changed since, inputs for instance. Only by that: the accelerations at the end of a step show its
   error times the stiffness. */
static void predict(const Instance *instance, Step step, double accelerations[]) {
    const State *state = &instance->state;
    const Memory *memory = &state->memory;
    const double rate = memory->length > 0.0 ? 1.0 / memory->length : 0.0;
    const double now = rate * (state->time - memory->start);
    double expected[N];
    continue_last(memory, now, expected);
    if (memory->length > 0.0 && state->time == memory->end) {
        memcpy(expected, memory->end_accelerations, sizeof expected);
    }
    for (int i = 0; i < S; i++) {
        continue_last(memory, now + rate * COLLOCATION.c[i] * step.length, accelerations + i * N);
        for (int k = 0; k < N; k++) {
            accelerations[i * N + k] += state->first_stage[N + k] - expected[k];
        }
    }
}

/* Newton's method with one linearization, until the rest is small against the error of the step. Where a stiff direction
   turns, the second change may well be as large as the first one and the third one small; so contractions are means of
   two. */
static bool iterate(Instance *instance, Step step, double tolerance, double accelerations[]) {
    const double enough = fmax(10.0 * DBL_EPSILON / tolerance, fmin(0.03, sqrt(tolerance)));
    double residual[SIZE], change[SIZE];
    double previous = 0.0, last_ratio = 0.0;
    predict(instance, step, accelerations);
    for (int iteration = 0; iteration < MOST_ITERATIONS; iteration++) {
        if (!residuals(instance, step, accelerations, residual)) {
            return false;
        }
        solve_linearized(&instance->scratch.implicit, residual, change);
        const double size = size_of(instance, step.length, tolerance, change);
        for (int i = 0; i < SIZE; i++) {
            accelerations[i] += change[i];
        }
        const double ratio = iteration > 0 ? size / previous : 0.5;
        const double contraction = iteration > 1 ? sqrt(ratio * last_ratio) : ratio;
        if (!(contraction < (iteration == 1 ? MOST_GROWTH : 1.0))) {
            break;
        }
        if (iteration > 0) {
            instance->state.memory.contraction = contraction;
        }
        if (contraction < 1.0 && size * contraction / (1.0 - contraction) <= enough) {
            return true;
        }
        previous = size;
        last_ratio = ratio;
    }
    return report_iteration(instance, step);
}

/* The accelerations at the stages, with K and D as they are, or anew where those do not do. */
static bool solve_stages(Instance *instance, Step step, double accelerations[]) {
    Memory *memory = &instance->state.memory;
    const double tolerance = inner_tolerance(solver_tolerance(&instance->state));
    if (memory->linearized && memory->contraction < KEEP && factorize(instance, step) &&
        iterate(instance, step, tolerance, accelerations)) {
        return true;
    }
    return linearize(instance) && factorize(instance, step) && iterate(instance, step, tolerance, accelerations);
}

/* error = (I - g J)^-1 g (derivatives + sum_i e_i z_i / h), J the Jacobian of the equations of first order. */
static void filter_error(const Instance *instance, double h, const double derivatives[], const double combined[],
                         double error[]) {
    const Implicit *work = &instance->scratch.implicit;
    const double g = h * MODES.real;
    double right[N], rest[N];
    for (int k = 0; k < N; k++) {
        rest[k] = g * (derivatives[k] + combined[k] / h);
    }
    for (int k = 0; k < N; k++) {
        right[k] = g * (derivatives[N + k] + combined[N + k] / h);
        for (int l = 0; l < N; l++) {
            right[k] += g * instance->state.memory.stiffness[k * N + l] * rest[l];
        }
    }
    lu_solve(work->real_matrix, work->real_rows, N, right, error + N);
    for (int k = 0; k < N; k++) {
        error[k] = rest[k] + g * error[N + k];
    }
}

/* The greatest error in units of the tolerance. */
static double error_size(const Instance *instance, double tolerance, int *worst) {
    const Scratch *scratch = &instance->scratch;
    const double inner = inner_tolerance(tolerance);
    double largest = 0.0;
    *worst = 0;
    for (int i = 0; i < N_STATES; i++) {
        const double size = fmax(fabs(instance->state.states[i]), fabs(scratch->new_states[i]));
        const double error = fabs(scratch->implicit.error[i]) / (inner * (size + NOMINAL_STATES[i]));
        if (!(error <= largest)) {
            largest = error;
            *worst = i;
        }
    }
    return largest;
}

/* The estimate of [HW] (8.19) or, where that is too large, the one of (8.20), which takes an evaluation. */
static bool estimate(Instance *instance, Step step, const double accelerations[]) {
    const double e[3] = {-(13.0 + 7.0 * SQRT6) / 3.0, (-13.0 + 7.0 * SQRT6) / 3.0, -1.0 / 3.0};
    const double *x = instance->state.states;
    double *error = instance->scratch.implicit.error;
    double combined[N_STATES] = {0.0}, states[N_STATES], derivatives[N_STATES];
    int worst;
    for (int i = 0; i < S; i++) {
        stage_states(instance, step.length, i, accelerations, states);
        for (int k = 0; k < N_STATES; k++) {
            combined[k] += e[i] * (states[k] - x[k]);
        }
    }
    filter_error(instance, step.length, instance->state.first_stage, combined, error);
    if (error_size(instance, solver_tolerance(&instance->state), &worst) <= 1.0) {
        return true;
    }
    for (int k = 0; k < N_STATES; k++) {
        states[k] = x[k] + error[k];
    }
    if (!equations_derivative(instance, instance->state.time, states, derivatives)) {
        return false;
    }
    filter_error(instance, step.length, derivatives, combined, error);
    return true;
}

/* The new states on the constraints, with the factorisation that the last stage has left: it is where they are. */
static bool finish(Instance *instance, Step step) {
#if N_CONSTRAINTS > 0
    return constraints_finish(instance, step.end, inputs_at(instance, step.end), instance->scratch.new_states);
#else
    (void)instance;
    (void)step;
    return true;
#endif
}

bool solver_step(Instance *instance, Step step) {
    Scratch *scratch = &instance->scratch;
    Memory *memory = &instance->state.memory;
    double accelerations[SIZE];
    if (!solve_stages(instance, step, accelerations)) {
        return false;
    }
    stage_states(instance, step.length, S - 1, accelerations, scratch->new_states);
    if (!finish(instance, step) || !estimate(instance, step, accelerations) ||
        !equations_derivative(instance, step.end, scratch->new_states, scratch->new_derivatives)) {
        return false;
    }
    memory->start = instance->state.time;
    memory->end = step.end;
    memory->length = step.length;
    memcpy(memory->accelerations, accelerations, sizeof memory->accelerations);
    memcpy(memory->end_accelerations, scratch->new_derivatives + N, sizeof memory->end_accelerations);
    return true;
}

double solver_error(const Instance *instance, Step step, double tolerance, int *worst) {
    (void)step;
    return error_size(instance, tolerance, worst);
}

double solver_stiffness(const Instance *instance) {
    (void)instance;
    return 0.0; /* L-stable */
}

/* Hermite's quintic for the coordinates, which meets their accelerations at both ends too, and its derivative for the
   velocities. It is as smooth as the motion and needs no evaluation; the polynomial through the stages has order 3. */
bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]) {
    const double h = step.length, *before = instance->state.first_stage, *after = instance->scratch.new_derivatives;
    double *fourth = terms[HERMITE_TERMS], *fifth = terms[HERMITE_TERMS + 1];
    for (int k = 0; k < N; k++) {
        fourth[k] = 0.5 * h * h * before[N + k] + terms[1][k] - terms[2][k];
        fifth[k] = 0.5 * h * h * (after[N + k] - before[N + k]) + 3.0 * terms[2][k];
        fourth[N + k] = 5.0 * fifth[k] / h;
        fifth[N + k] = 0.0;
    }
    return true;
}
