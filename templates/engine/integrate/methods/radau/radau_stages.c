/* The stages of Radau IIA, see radau.c. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "collocation.h"
#include "contacts.h"
#include "derivative.h"
#include "finite.h"
#include "jacobian.h"
#include "lu.h"
#include "radau_stages.h"
#include "step_failure.h"

enum { SIZE_OF_STAGES = (int)S * R, MOST_STAGE_ITERATIONS = 10 };

/* The second change of the iterations over the first one: beyond it they do not converge. */
static const double MOST_GROWTH = 4.0;

/* A change of the iterations over the one before: where it is less, K and D are kept for the next step. */
static const double KEEP = 0.02;

/* matrix = I - h b x D - h^2 (b b) x K for a block b of the modes (size x size), factorised. */
static bool factorize_block(const SolverMemory *memory, double h, const double b[], int size, double matrix[],
                            int rows[]) {
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < size; j++) {
            double square = 0.0;
            for (int k = 0; k < size; k++) {
                square += b[i * size + k] * b[k * size + j];
            }
            for (int k = 0; k < R; k++) {
                for (int l = 0; l < R; l++) {
                    matrix[(i * R + k) * size * R + j * R + l] = (i == j && k == l ? 1.0 : 0.0) -
                        h * b[i * size + j] * memory->damping[k * R + l] -
                        h * h * square * (l < N ? memory->stiffness[k * N + l] : 0.0);
                }
            }
        }
    }
    return lu_factorize(matrix, rows, size * R);
}

/* K and D at the present point. */
static bool linearize(Instance *instance) {
    SolverMemory *memory = &instance->state.solver;
    double *jacobian = instance->scratch.solver.jacobian;
    memory->linearized = 0;
    if (!equations_jacobian(instance, instance->state.time, instance->state.states, jacobian)) {
        return false;
    }
    for (int k = 0; k < R; k++) {
        for (int l = 0; l < N; l++) {
            memory->stiffness[k * N + l] = jacobian[l * R + k];
        }
        for (int l = 0; l < R; l++) {
            memory->damping[k * R + l] = jacobian[(N + l) * R + k];
        }
    }
    memory->linearized = 1;
    return true;
}

/* The factors of the systems for this length of step. */
static bool factorize_stages(Instance *instance, Step step) {
    const SolverMemory *memory = &instance->state.solver;
    SolverScratch *work = &instance->scratch.solver;
    return (factorize_block(memory, step.length, &MODES.real, 1, work->real_matrix, work->real_rows) &&
            factorize_block(memory, step.length, MODES.pair, 2, work->pair_matrix, work->pair_rows)) ||
           report_iteration(instance, step);
}

/* result[S * R] = matrix x I . stages */
static void combine_stages(const double matrix[], const double stages[], double result[]) {
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < R; k++) {
            double sum = 0.0;
            for (int j = 0; j < S; j++) {
                sum += matrix[i * S + j] * stages[j * R + k];
            }
            result[i * R + k] = sum;
        }
    }
}

/* The change of the accelerations at the stages that the linearized equations ask for. */
static void solve_linearized(Arena *arena, const SolverScratch *work, const double residual[], double change[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, modes, SIZE_OF_STAGES);
    WORK(mark, double, solved, SIZE_OF_STAGES);
    combine_stages(MODES.to_modes, residual, modes);
    lu_solve(work->real_matrix, work->real_rows, R, modes, solved);
    lu_solve(work->pair_matrix, work->pair_rows, 2 * R, modes + R, solved + R);
    combine_stages(MODES.from_modes, solved, change);
    arena_release(mark);
}

void radau_stage(const double x[], double h, int i, const double accelerations[], double states[]) {
    for (int k = 0; k < R; k++) {
        double first = 0.0, second = 0.0;
        for (int j = 0; j < S; j++) {
            first += COLLOCATION.a[i * S + j] * accelerations[j * R + k];
            second += MODES.squared[i * S + j] * accelerations[j * R + k];
        }
        if (k < N) {
            states[k] = x[k] + h * (COLLOCATION.c[i] * x[N + k] + h * second);
        }
        states[N + k] = x[N + k] + h * first;
    }
}

double radau_stage_time(const Instance *instance, Step step, int i) {
    return COLLOCATION.c[i] == 1.0 ? step.end : instance->state.time + COLLOCATION.c[i] * step.length;
}

/* residual[S * R] = qdd and dz/dt at the stages less those that led there. */
static bool residuals(Instance *instance, Step step, const double accelerations[], double residual[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, derivatives, N_STATES);
    for (int i = 0; i < S; i++) {
        radau_stage(instance->state.states, step.length, i, accelerations, states);
        if (!derivative_at(instance, radau_stage_time(instance, step, i), states, derivatives)) {
            return arena_leave(mark, false);
        }
        for (int k = 0; k < R; k++) {
            residual[i * R + k] = derivatives[N + k] - accelerations[i * R + k];
        }
    }
    return arena_leave(mark, true);
}

/* What a change of the accelerations changes in the states, in units of the tolerance. */
static double size_of_change(const Instance *instance, double h, double tolerance, const double change[]) {
    double greatest = 0.0;
    for (int k = 0; k < R; k++) {
        const double *x = instance->state.states + k, *nominal = NOMINAL_STATES + k;
        double largest = 0.0;
        for (int i = 0; i < S; i++) {
            const double size = fabs(change[i * R + k]);
            largest = size > largest ? size : largest;
        }
        const double in_velocity = h * largest / (fabs(x[N]) + nominal[N]);
        const double in_position = k < N ? h * h * largest / (fabs(x[0]) + nominal[0]) : 0.0;
        const double size = in_velocity > in_position ? in_velocity : in_position;
        greatest = size > greatest ? size : greatest;
    }
    return all_finite(change, SIZE_OF_STAGES) ? greatest / tolerance : HUGE_VAL;
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

void radau_polynomial(const SolverMemory *memory, double x, double accelerations[]) {
    double weights[S];
    weigh_stages(x, weights);
    for (int k = 0; k < R; k++) {
        accelerations[k] = 0.0;
        for (int j = 0; j < S && memory->length > 0.0; j++) {
            accelerations[k] += weights[j] * memory->accelerations[j * R + k];
        }
    }
}

/* The accelerations[r] at the present time that go with the last step that was solved: of the equations where it begins
   and where it ends, else of the polynomial. */
static void expect(const State *state, double now, double accelerations[]) {
    const SolverMemory *memory = &state->solver;
    if (memory->length > 0.0 && (state->time == memory->start || state->time == memory->end)) {
        memcpy(accelerations, state->time == memory->end ? memory->end_accelerations : memory->start_accelerations,
               R * sizeof(double));
    } else {
        radau_polynomial(memory, now, accelerations);
    }
}

/* Where the iterations begin: the polynomial through the accelerations of the last solved step, continued, and moved by
   what was changed since, inputs for instance. It is moved by that alone, because between steps the accelerations show
   the error times the stiffness. */
static void predict(const Instance *instance, Step step, double accelerations[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, expected, R);
    const State *state = &instance->state;
    const SolverMemory *memory = &state->solver;
    const double rate = memory->length > 0.0 ? 1.0 / memory->length : 0.0;
    const double now = rate * (state->time - memory->start);
    expect(state, now, expected);
    for (int i = 0; i < S; i++) {
        radau_polynomial(memory, now + rate * COLLOCATION.c[i] * step.length, accelerations + i * R);
        for (int k = 0; k < R; k++) {
            accelerations[i * R + k] += state->first_stage[N + k] - expected[k];
        }
    }
    arena_release(mark);
}

/* Newton's method with one linearization, until the rest is small against the error of the step. Where a stiff
   direction turns, the second change may be as large as the first one and the third one small; so contractions are
   means over two changes. */
static bool iterate(Instance *instance, Step step, double tolerance, double accelerations[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, residual, SIZE_OF_STAGES);
    WORK(mark, double, change, SIZE_OF_STAGES);
    const double enough = fmax(10.0 * DBL_EPSILON / tolerance, fmin(0.03, sqrt(tolerance)));
    double previous = 0.0, last_ratio = 0.0;
    predict(instance, step, accelerations);
    for (int iteration = 0; iteration < MOST_STAGE_ITERATIONS; iteration++) {
        if (!residuals(instance, step, accelerations, residual)) {
            return arena_leave(mark, false);
        }
        solve_linearized(instance->arena, &instance->scratch.solver, residual, change);
        const double size = size_of_change(instance, step.length, tolerance, change);
        for (int i = 0; i < SIZE_OF_STAGES; i++) {
            accelerations[i] += change[i];
        }
        const double ratio = iteration > 0 ? size / previous : 0.5;
        const double contraction = iteration > 1 ? sqrt(ratio * last_ratio) : ratio;
        if (!(contraction < (iteration == 1 ? MOST_GROWTH : 1.0))) {
            break;
        }
        if (iteration > 0) {
            instance->state.solver.contraction = contraction;
        }
        if (contraction < 1.0 && size * contraction / (1.0 - contraction) <= enough) {
            return arena_leave(mark, true);
        }
        previous = size;
        last_ratio = ratio;
    }
    return arena_leave(mark, report_iteration(instance, step));
}

/* Tries with K and D as they are, and with new ones if that fails. Friction in space becomes less stiff as its slip
   becomes faster. Old K and D, which are too stiff, would hold the direction of the slip, and changes of the iterations
   would be too small to show it: new ones are taken in each step. */
bool radau_solve(Instance *instance, Step step, double tolerance, double accelerations[]) {
    SolverMemory *memory = &instance->state.solver;
    if (memory->linearized && memory->contraction < KEEP && !contacts_slide_in_space(instance) &&
        factorize_stages(instance, step) &&
        iterate(instance, step, tolerance, accelerations)) {
        return true;
    }
    return linearize(instance) && factorize_stages(instance, step) && iterate(instance, step, tolerance, accelerations);
}

void radau_filter(const Instance *instance, double h, double x[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, right, R);
    const SolverScratch *work = &instance->scratch.solver;
    const double g = h * MODES.real;
    for (int k = 0; k < R; k++) {
        right[k] = x[N + k];
        for (int l = 0; l < N; l++) {
            right[k] += g * instance->state.solver.stiffness[k * N + l] * x[l];
        }
    }
    lu_solve(work->real_matrix, work->real_rows, R, right, x + N);
    for (int k = 0; k < N; k++) {
        x[k] += g * x[N + k];
    }
    arena_release(mark);
}
