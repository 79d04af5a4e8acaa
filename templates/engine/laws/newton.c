/* A generalised Newton method for the equations that the laws choose: Alart, Curnier, A mixed formulation for
   frictional contact problems prone to Newton like solution methods, Comput. Methods Appl. Mech. Eng. 1991. What is
   held, open or slides, and how it turns, follows from x less a proximal step along w. The steps are the same for both
   axes of a cone: the axes do not matter to the solution. */
#include "newton.h"

#include <math.h>
#include <string.h>

#include "least_norm.h"
#include "scale.h"
#include "vector_length.h"

enum { MOST_NEWTON_STEPS = 40 };

/* A diagonal entry is taken for no less than this. */
static const double LEAST_STEP = 1e-3;

/* The inverse of the proximal step of a row: a bound of the block's eigenvalues. */
static double curvature(const Laws *laws, int k) {
    const int first = laws->width[k] < 0 ? k - 1 : k;
    double sum = laws->matrix[first * laws->size + first];
    sum += laws->width[first] == 2 ? laws->matrix[(first + 1) * laws->size + first + 1] : 0.0;
    return fmax(sum, LEAST_STEP);
}

/* Row k of the equations of a row or cone that sticks: w = 0, divided by the curvature. */
static void put_held(const Laws *laws, int k, const double w[], double matrix[], double right[]) {
    const double rate = 1.0 / curvature(laws, k);
    for (int j = 0; j < laws->size; j++) {
        matrix[k * laws->size + j] = rate * laws->matrix[k * laws->size + j];
    }
    right[k] = -rate * w[k];
}

/* Rows k and k + 1 of a cone that slides: x - limit u = 0 with the direction u of the trial x - rate w. */
static void put_cone(const Laws *laws, int k, double rate, const double x[], const double trial[], double matrix[],
                        double right[]) {
    const int n = laws->size, width = laws->width[k], normal = laws->normal[k];
    const double length = vector_length(trial, 2), limit = laws_limit(laws, x, k);
    for (int i = 0; i < width; i++) {
        const double u = trial[i] / length;
        double *row = matrix + (k + i) * n;
        memset(row, 0, (size_t)n * sizeof(double));
        row[k + i] += 1.0;
        right[k + i] = limit * u - x[k + i];
        if (normal >= 0) {
            row[normal] -= laws->slope[k] * u;
        }
        for (int j = 0; j < width; j++) {
            const double turn = limit / length * ((i == j ? 1.0 : 0.0) - u * trial[j] / length);
            row[k + j] -= turn;
            for (int column = 0; column < n; column++) {
                row[column] += turn * rate * laws->matrix[(k + j) * n + column];
            }
        }
    }
}

/* Row k of what is open: x = 0. */
static void put_open(const Laws *laws, int k, const double x[], double matrix[], double right[]) {
    memset(matrix + k * laws->size, 0, (size_t)laws->size * sizeof(double));
    matrix[k * laws->size + k] = 1.0;
    right[k] = -x[k];
}

/* The linearised equations of one row or cone for the change of x. */
static void linearise(const Laws *laws, int k, double step, const double x[], const double w[], double matrix[],
                      double right[]) {
    const int width = laws->width[k], rows = width > 0 ? width : 1;
    const double rate = (width > 0 ? step : 1.0) / curvature(laws, k);
    double trial[2] = {0.0, 0.0};
    for (int i = 0; i < rows; i++) {
        trial[i] = x[k + i] - rate * w[k + i];
    }
    const double length = vector_length(trial, 2), limit = width > 0 ? laws_limit(laws, x, k) : 0.0;
    const bool held = width == 0 ? trial[0] > 0.0 : length <= limit && limit > 0.0;
    for (int i = k; i < k + rows; i++) {
        if (held) {
            put_held(laws, i, w, matrix, right);
        } else if (width == 0 || length == 0.0) {
            put_open(laws, i, x, matrix, right);
        }
    }
    if (!held && width > 0 && length > 0.0) {
        put_cone(laws, k, rate, x, trial, matrix, right);
    }
}

/* From x near a solution to it, with so many times the proximal step for friction. */
static bool refine_with(const Laws *laws, double step, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t n = (size_t)laws->size, bytes = n * sizeof(double);
    if (!arena_reserve(laws->arena, 2 * (n + 6) * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *matrix = (double *)arena_take(laws->arena, (size_t)laws->size * bytes);
    double *right = (double *)arena_take(laws->arena, bytes);
    double *w = (double *)arena_take(laws->arena, bytes), *change = (double *)arena_take(laws->arena, bytes);
    bool done = false;
    for (int count = 0; count < MOST_NEWTON_STEPS && !done; count++) {
        double moved = 0.0, size = 0.0;
        laws_evaluate(laws, x, w);
        for (int k = 0; k < laws->size; k++) {
            if (laws->width[k] >= 0) {
                linearise(laws, k, step, x, w, matrix, right);
            }
        }
        least_norm_solve(laws->arena, laws->size, matrix, right, change);
        for (int k = 0; k < laws->size; k++) {
            x[k] += change[k];
            moved = fmax(moved, fabs(change[k]));
            size = fmax(size, fabs(x[k]));
        }
        done = moved <= SOLVED * size;
    }
    return arena_leave(mark, laws_obeyed(laws, x));
}

/* From a start near a solution to it. The steps differ in where they lead to from afar; the long ones serve where
   friction wedges. */
bool newton_solve(const Laws *laws, const double start[], double x[]) {
    static const double STEPS[] = {1.0, 10.0, 0.1, 100.0, 3.0, 30.0};
    bool solved = false;
    for (size_t i = 0; i < sizeof STEPS / sizeof *STEPS && !solved; i++) {
        memcpy(x, start, (size_t)laws->size * sizeof(double));
        solved = refine_with(laws, STEPS[i], x);
    }
    return solved;
}
