/* Projected Gauss-Seidel and its conjugate directions. */
#include "sweeps.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "scale.h"
#include "vector_length.h"

/* In units of the greatest offset: where x is greater, there is no solution. */
static const double MOST_GROWTH_OF_FORCES = 1e10;

/* The nearest point that the law allows to x - w / curvature, for the rows of a row or cone; returns how many. */
static int project_rows(const Laws *laws, int k, const double x[], const double w[], double to[]) {
    const int rows = laws->width[k] == 2 ? 2 : 1;
    for (int i = 0; i < rows; i++) {
        to[i] = x[k + i] - w[k + i] / laws->curvature[k];
    }
    if (laws->width[k] == 0) {
        to[0] = fmax(to[0], 0.0);
        return rows;
    }
    const double length = vector_length(to, rows), limit = laws_limit(laws, x, k);
    for (int i = 0; i < rows && length > limit; i++) {
        to[i] *= limit / length;
    }
    return rows;
}

void sweep(const Laws *laws, double x[], double w[]) {
    const Sparse *matrix = &laws->matrix;
    double to[2];
    for (int k = 0, rows = 1; k < laws->size; k += rows) {
        rows = project_rows(laws, k, x, w, to);
        for (int i = k; i < k + rows; i++) {
            const double change = to[i - k] - x[i];
            x[i] = to[i - k];
            for (int e = matrix->start[i]; e < matrix->start[i + 1] && change != 0.0; e++) {
                w[matrix->column[e]] += matrix->value[e] * change; /* the matrix is symmetric */
            }
        }
    }
}

bool sweeps_descend(const Laws *laws, int sweeps, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const int n = laws->size;
    const size_t bytes = (size_t)n * sizeof(double);
    double last = HUGE_VAL;
    if (!arena_reserve(laws->arena, 3 * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *before = (double *)arena_take(laws->arena, bytes), *w = (double *)arena_take(laws->arena, bytes);
    double *direction = (double *)arena_take(laws->arena, bytes);
    memset(direction, 0, bytes);
    for (int s = 0; s <= sweeps; s++) {
        double square = 0.0;
        memcpy(before, x, bytes);
        laws_evaluate(laws, x, w);
        sweep(laws, x, w);
        for (int k = 0; k < n; k++) {
            square += laws->curvature[k] * (x[k] - before[k]) * (x[k] - before[k]);
        }
        const double part = square <= last && last > 0.0 && s < sweeps ? square / last : 0.0;
        for (int k = 0; k < n; k++) {
            const double change = x[k] - before[k];
            x[k] += part * direction[k];
            direction[k] = square <= last ? part * direction[k] + change : 0.0;
        }
        last = square;
    }
    return arena_leave(mark, true);
}

double sweeps_residual(const Laws *laws, const double x[], double w[], double *moved) {
    const double size = vector_greatest(x, laws->size), usual = vector_greatest(laws->offset, laws->size);
    double to[2], most = 0.0;
    laws_evaluate(laws, x, w);
    for (int k = 0, rows = 1; k < laws->size; k += rows) {
        rows = project_rows(laws, k, x, w, to);
        for (int i = k; i < k + rows; i++) {
            most = fmax(most, fabs(to[i - k] - x[i]));
        }
    }
    *moved = size > 0.0 ? most / size : 1.0;
    const double rest = size > MOST_GROWTH_OF_FORCES * usual ? size : most - NOISE * size;
    return rest > 0.0 ? rest / fmax(usual, DBL_MIN) : 0.0;
}
