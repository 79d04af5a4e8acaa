/* The equations of a step. The steps are the same for both axes of a cone: the axes do not matter to the solution. */
#include "newton_step.h"

#include "least_norm.h"
#include "scale.h"
#include "vector_length.h"

/* Row k of the equations += factor times row `of` of the matrix. */
static void add_row(const Newton *newton, int k, int of, double factor) {
    const Sparse *matrix = &newton->laws->matrix;
    for (int e = matrix->start[of]; e < matrix->start[of + 1]; e++) {
        *step_matrix_entry(&newton->equations, k, matrix->column[e]) += factor * matrix->value[e];
    }
}

/* Row k of the equations of a row or cone that sticks: w = 0, divided by the curvature, and damped: Yamashita,
   Fukushima, On the rate of convergence of the Levenberg-Marquardt method, Computing 15, 2001. */
static void put_held(const Newton *newton, int k) {
    const double rate = 1.0 / newton->laws->curvature[k];
    add_row(newton, k, k, rate);
    *step_matrix_entry(&newton->equations, k, k) += newton->damping;
    newton->right[k] = -rate * newton->w[k];
}

/* Rows k and k + 1 of a cone that slides: x - limit u = 0 with the direction u of the trial x - rate w. A normal force
   that is negative on the way limits friction to 0 wherever it goes. */
static void put_cone(const Newton *newton, int k, double rate, const double trial[]) {
    const Laws *laws = newton->laws;
    const int width = laws->width[k], normal = laws->normal[k];
    const double length = vector_length(trial, 2), limit = laws_limit(laws, newton->x, k);
    for (int i = 0; i < width; i++) {
        const double u = trial[i] / length;
        newton->right[k + i] = limit * u - newton->x[k + i];
        *step_matrix_entry(&newton->equations, k + i, k + i) += 1.0;
        if (normal >= 0 && newton->x[normal] >= 0.0) {
            *step_matrix_entry(&newton->equations, k + i, normal) -= laws->slope[k] * u;
        }
        for (int j = 0; j < width; j++) {
            const double turn = limit / length * ((i == j ? 1.0 : 0.0) - u * trial[j] / length);
            *step_matrix_entry(&newton->equations, k + i, k + j) -= turn;
            add_row(newton, k + i, k + j, turn * rate);
        }
    }
}

/* The linearised equations of one row or cone for the change of x. */
static void linearise(const Newton *newton, int k) {
    const Laws *laws = newton->laws;
    const int width = laws->width[k], rows = width > 0 ? width : 1;
    const double rate = (width > 0 ? newton->step : 1.0) / laws->curvature[k];
    double trial[2] = {0.0, 0.0};
    for (int i = 0; i < rows; i++) {
        trial[i] = newton->x[k + i] - rate * newton->w[k + i];
    }
    const double length = vector_length(trial, 2), limit = width > 0 ? laws_limit(laws, newton->x, k) : 0.0;
    const bool held = width == 0 ? trial[0] > 0.0 : length <= limit && limit > 0.0;
    if (!held && width > 0 && length > 0.0) {
        put_cone(newton, k, rate, trial);
        return;
    }
    for (int i = k; i < k + rows; i++) {
        if (held) {
            put_held(newton, i);
        } else {
            *step_matrix_entry(&newton->equations, i, i) += 1.0; /* open: x = 0 */
            newton->right[i] = -newton->x[i];
        }
    }
}

/* The change of x, that of least norm for few rows. False: the equations are singular. */
static bool solve_equations(const Newton *newton) {
    const StepMatrix *equations = &newton->equations;
    if (equations->full != NULL) {
        least_norm_solve(newton->laws->arena, equations->size, equations->full, newton->right, newton->change);
        return true;
    }
    if (!step_matrix_factorize(equations, SOLVED)) {
        return false;
    }
    step_matrix_solve(equations, newton->right, newton->change);
    return true;
}

bool newton_step(const Newton *newton) {
    const Laws *laws = newton->laws;
    laws_evaluate(laws, newton->x, newton->w);
    step_matrix_clear(&newton->equations);
    for (int k = 0; k < laws->size; k++) {
        if (laws->width[k] >= 0) {
            linearise(newton, k);
        }
    }
    if (!solve_equations(newton)) {
        return false;
    }
    for (int k = 0; k < laws->size; k++) {
        newton->x[k] += newton->change[k];
    }
    return true;
}
