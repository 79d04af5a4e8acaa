/* Directions through steps of Radau IIA. With A_i the accelerations at the stages and X_i(x, A) the states there
   (radau.c), A_i = f(X_i, p) gives

       dA_i - sum_j f_x(X_i) dX_i/dA_j dA_j = f_x(X_i) dX_i/dx S + f_p dp.

   The derivatives at each stage are exact ones, and the equations of all stages are solved at once: there is nothing to
   iterate, and the result is the derivative of the step up to the rest of its own iterations. Bock, Numerical treatment
   of inverse problems in chemical reaction kinetics, 1981 (internal differentiation). */
#include "directed_radau.h"

#include <math.h>
#include <string.h>

#include "collocation.h"
#include "directed_steps.h"
#include "jacobian.h"
#include "lu.h"
#include "radau_stages.h"
#include "step_failure.h"

enum { SIZE_OF_STEP = (int)S * R };

/* Adds the rows of stage i to the matrix. */
static void add_rows(DirectedMemory *method, double h, int i, bool transposed) {
    for (int k = 0; k < R; k++) {
        for (int j = 0; j < S; j++) {
            for (int l = 0; l < R; l++) {
                const double stiffness = l < N ? method->jacobian[l * R + k] : 0.0;
                const double damping = method->jacobian[(N + l) * R + k];
                const int row = i * R + k, column = j * R + l;
                method->matrix[transposed ? column * SIZE_OF_STEP + row : row * SIZE_OF_STEP + column] =
                    (row == column ? 1.0 : 0.0) -
                    h * (COLLOCATION.a[i * S + j] * damping + h * MODES.squared[i * S + j] * stiffness);
            }
        }
    }
}

bool radau_linearize(Variations *variations, Step step, const double accelerations[], bool transposed) {
    Instance *instance = &variations->study.instance;
    DirectedMemory *method = &variations->method;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    for (int i = 0; i < S; i++) {
        radau_stage(instance->state.states, step.length, i, accelerations, states);
        if (!equations_jacobian(instance, radau_stage_time(instance, step, i), states, method->jacobian)) {
            return arena_leave(mark, false);
        }
        add_rows(method, step.length, i, transposed);
    }
    return arena_leave(mark, lu_factorize(method->matrix, method->rows, SIZE_OF_STEP) ||
                                 report_iteration(instance, step));
}

/* The rates at all stages for accelerations there that do not change. */
static bool begin_stages(Variations *variations, Step step) {
    static const double NO_CHANGE[SIZE_OF_STEP] = {0.0};
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    for (int i = 0; i < S; i++) {
        radau_stage(instance->state.states, step.length, i, instance->state.solver.accelerations, states);
        for (int d = 0; d < variations->count; d++) {
            Direction *direction = &variations->directions[d];
            radau_stage(direction->states, step.length, i, NO_CHANGE, direction->seed.states);
        }
        if (!directions_evaluate(variations, radau_stage_time(instance, step, i), states)) {
            return arena_leave(mark, false);
        }
        for (int d = 0; d < variations->count; d++) {
            memcpy(variations->directions[d].stages[i], variations->directions[d].rates, N_STATES * sizeof(double));
        }
    }
    return arena_leave(mark, true);
}

/* accelerations[STAGES * r] of a direction at the stages. */
static void gather_accelerations(const Direction *direction, double accelerations[]) {
    for (int i = 0; i < S; i++) {
        memcpy(accelerations + i * R, direction->stages[i] + N, R * sizeof(double));
    }
}

bool directions_follow(Variations *variations, Step step) {
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, right, SIZE_OF_STEP);
    WORK(mark, double, change, SIZE_OF_STEP);
    const bool moves = step.length > 0.0;
    if (moves && variations->count > 0 &&
        (!radau_linearize(variations, step, instance->state.solver.accelerations, false) ||
         !begin_stages(variations, step))) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->new_states, direction->states, sizeof direction->new_states);
        memcpy(direction->new_slope, direction->slope, sizeof direction->new_slope);
        if (moves) {
            gather_accelerations(direction, right);
            lu_solve(variations->method.matrix, variations->method.rows, SIZE_OF_STEP, right, change);
            for (int i = 0; i < S; i++) {
                memcpy(direction->stages[i] + N, change + i * R, R * sizeof(double));
            }
            radau_stage(direction->states, step.length, S - 1, change, direction->new_states);
        }
    }
    return arena_leave(mark, true);
}

bool directions_have_slope(void) {
    return false;
}

double directions_error(Variations *variations, int d, Step step, double tolerance) {
    Instance *instance = &variations->study.instance;
    const Direction *direction = &variations->directions[d];
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, accelerations, SIZE_OF_STEP);
    WORK_ROWS(mark, double, errors, 2, N_STATES);
    const double rounding = direction_rounding(variations, direction);
    double greatest = 0.0;
    gather_accelerations(direction, accelerations);
    radau_errors(instance, step.length, direction->states, direction->slope, accelerations, errors);
    for (int k = 0; k < N_STATES; k++) {
        const double size = fmax(fabs(direction->states[k]), fabs(direction->new_states[k]));
        const double usual = size + NOMINAL_STATES[k] / direction->scale;
        const double unit = 1.0 / (usual + rounding / tolerance * NOMINAL_STATES[k]);
        const double first = unit * fabs(errors[0][k]) / radau_inner_tolerance(tolerance);
        const double error = fmax(first, unit * fabs(errors[1][k]) / tolerance);
        greatest = error <= greatest ? greatest : error; /* what is no number too */
    }
    arena_release(mark);
    return isfinite(greatest) ? greatest : HUGE_VAL;
}

bool directions_within(Variations *variations, Step step) {
    (void)variations;
    (void)step;
    return true; /* steps hold no samples */
}
