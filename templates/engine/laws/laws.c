/* The equations of a choice, and whether a solution obeys the laws. */
#include "laws.h"

#include <math.h>
#include <string.h>

#include "least_norm.h"
#include "scale.h"
#include "vector_length.h"

/* In units of a scaled diagonal entry: the least curvature, so that the steps of redundant rows stay finite. */
static const double LEAST_CURVATURE = 1e-3;

size_t laws_bytes(size_t size, size_t entries) {
    return sparse_bytes(size, entries) + 5 * arena_bytes(size, sizeof(double)) + 2 * arena_bytes(size, sizeof(int)) +
           arena_bytes(size, sizeof(bool));
}

Laws laws_take(Arena *arena, Sparse matrix) {
    const size_t n = (size_t)matrix.rows;
    return (Laws){.arena = arena,
                  .size = matrix.rows,
                  .matrix = matrix,
                  .first = NULL,
                  .offset = (double *)arena_take(arena, n * sizeof(double)),
                  .terms = (double *)arena_take(arena, n * sizeof(double)),
                  .determined = (bool *)arena_take(arena, n * sizeof(bool)),
                  .curvature = (double *)arena_take(arena, n * sizeof(double)),
                  .width = (int *)arena_take(arena, n * sizeof(int)),
                  .normal = (int *)arena_take(arena, n * sizeof(int)),
                  .slope = (double *)arena_take(arena, n * sizeof(double)),
                  .base = (double *)arena_take(arena, n * sizeof(double))};
}

static void *take_zeros(Arena *arena, size_t bytes) {
    return memset(arena_take(arena, bytes), 0, bytes);
}

Choice choice_take(Arena *arena, int size) {
    const size_t n = (size_t)size;
    return (Choice){.held = (bool *)take_zeros(arena, n * sizeof(bool)),
                    .slope = (double *)take_zeros(arena, n * sizeof(double)),
                    .value = (double *)take_zeros(arena, n * sizeof(double))};
}

void choice_limit(const Laws *laws, int k, double side, Choice *choice) {
    choice->value[k] = side * laws->base[k];
    choice->slope[k] = laws->normal[k] >= 0 ? side * laws->slope[k] : 0.0;
}

void laws_evaluate(const Laws *laws, const double x[], double w[]) {
    sparse_multiply(&laws->matrix, x, w);
    for (int i = 0; i < laws->size; i++) {
        w[i] += laws->offset[i];
    }
}

static double matrix_entry(const Laws *laws, int i, int j) {
    double entry = 0.0;
    for (int e = laws->matrix.start[i]; e < laws->matrix.start[i + 1]; e++) {
        entry = laws->matrix.column[e] == j ? laws->matrix.value[e] : entry;
    }
    return entry;
}

void laws_curve(const Laws *laws) {
    for (int k = 0; k < laws->size; k++) {
        const int width = laws->width[k];
        const double a = matrix_entry(laws, k, k);
        laws->curvature[k] = fmax(a, LEAST_CURVATURE);
        if (width == 2) {
            const double b = matrix_entry(laws, k, k + 1), c = matrix_entry(laws, k + 1, k + 1);
            laws->curvature[k] = fmax(0.5 * (a + c + sqrt((a - c) * (a - c) + 4.0 * b * b)), LEAST_CURVATURE);
        } else if (width < 0) {
            laws->curvature[k] = laws->curvature[k - 1];
        }
    }
}

static void solve_choice(const Laws *laws, const Choice *choice, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const int n = laws->size;
    const size_t bytes = (size_t)n * sizeof(double);
    double *matrix = (double *)arena_take(laws->arena, (size_t)n * bytes);
    double *right = (double *)arena_take(laws->arena, bytes);
    double *change = (double *)arena_take(laws->arena, bytes), *w = (double *)arena_take(laws->arena, bytes);
    laws_evaluate(laws, x, w);
    for (int k = 0; k < n; k++) {
        double *row = matrix + k * n;
        memset(row, 0, (size_t)n * sizeof(double));
        if (choice->held[k]) {
            for (int e = laws->matrix.start[k]; e < laws->matrix.start[k + 1]; e++) {
                row[laws->matrix.column[e]] = laws->matrix.value[e];
            }
            right[k] = -w[k];
            continue;
        }
        row[k] = 1.0;
        right[k] = choice->value[k] - x[k];
        if (laws->normal[k] >= 0) {
            row[laws->normal[k]] -= choice->slope[k];
            right[k] += choice->slope[k] * x[laws->normal[k]];
        }
    }
    even_solve(laws->arena, n, matrix, right, change);
    for (int k = 0; k < n; k++) {
        x[k] += change[k];
    }
    arena_release(mark);
}

double laws_terms(const Laws *laws, const double x[], int k) {
    double sum = laws->terms[k];
    for (int e = laws->matrix.start[k]; e < laws->matrix.start[k + 1]; e++) {
        sum += fabs(laws->matrix.value[e] * x[laws->matrix.column[e]]);
    }
    return sum;
}

/* Are the friction x and the slip w, of width components, within Coulomb's law or that of dry friction, whose greatest
   force is limit? size is the sum of the terms of the rows, least the slip that counts as none, rounding the error that
   all rows leave in one. */
static bool friction_obeyed(const double x[], const double w[], int width, double limit, double size, double least,
                            double rounding) {
    const double force = vector_length(x, width), slip = vector_length(w, width);
    double difference[2];
    if (slip <= least) {
        return force <= limit + OBEYED * fmax(size, limit) + rounding;
    }
    if (limit == HUGE_VAL) {
        return false;
    }
    for (int i = 0; i < width; i++) {
        difference[i] = x[i] + limit * w[i] / slip;
    }
    return vector_length(difference, width) * slip <= OBEYED * size * fmax(size, limit);
}

double laws_limit(const Laws *laws, const double x[], int k) {
    const int normal = laws->normal[k];
    return laws->base[k] + (normal >= 0 ? laws->slope[k] * fmax(x[normal], 0.0) : 0.0);
}

/* What may be left of a row. */
typedef struct {
    double rounding; /* of one that is solved together with all others: NOISE of the greatest terms of any row */
    double felt;     /* the part of the offsets that is the most, as it shows in the motion */
} Rest;

static Rest find_rest(const Laws *laws, const double x[]) {
    double greatest = 0.0, offset = 0.0;
    for (int k = 0; k < laws->size; k++) {
        greatest = fmax(greatest, laws_terms(laws, x, k));
        offset = fmax(offset, laws->terms[k]);
    }
    const Rest rest = {NOISE * greatest, LOCATED_LOOSELY * offset};
    return rest;
}

static bool law_obeyed(const Laws *laws, const double x[], const double w[], const Rest *rest, int k) {
    double size = laws_terms(laws, x, k);
    size += laws->width[k] == 2 ? laws_terms(laws, x, k + 1) : 0.0;
    const double least = fmin(OBEYED * size, rest->felt) + rest->rounding;
    if (laws->width[k] == 0) {
        const double pull = OBEYED * size + rest->rounding;
        return x[k] >= -pull && w[k] >= -least && (x[k] <= pull || w[k] <= least);
    }
    return laws->width[k] < 0 ||
           friction_obeyed(x + k, w + k, laws->width[k], laws_limit(laws, x, k), size, least, rest->rounding);
}

bool laws_obeyed(const Laws *laws, const double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    double *w = (double *)arena_take(laws->arena, (size_t)laws->size * sizeof(double));
    bool obeyed = true;
    const Rest rest = find_rest(laws, x);
    laws_evaluate(laws, x, w);
    for (int k = 0; k < laws->size && obeyed; k++) {
        obeyed = law_obeyed(laws, x, w, &rest, k);
    }
    return arena_leave(mark, obeyed);
}

bool laws_bounded(const Laws *laws, const Choice *choice, const double x[]) {
    bool bounded = true;
    for (int k = 0; k < laws->size && bounded; k++) {
        if (laws->width[k] == 0) {
            bounded = x[k] >= 0.0;
        } else if (laws->width[k] > 0 && choice->held[k]) {
            const double most = laws_limit(laws, x, k) + NOISE * laws_terms(laws, x, k);
            bounded = vector_length(x + k, laws->width[k]) <= most;
        }
    }
    return bounded;
}

bool laws_try(const Laws *laws, const Choice *choice, double x[]) {
    solve_choice(laws, choice, x);
    return laws_obeyed(laws, x);
}

bool laws_at_rest(const Laws *laws, const double x[], int k) {
    double w = laws->offset[k];
    for (int e = laws->matrix.start[k]; e < laws->matrix.start[k + 1]; e++) {
        w += laws->matrix.value[e] * x[laws->matrix.column[e]];
    }
    return fabs(w) <= ACCEPTED * laws_terms(laws, x, k);
}

bool laws_slips(const Laws *laws, const double x[], int k) {
    const int rows = laws->width[k];
    return rows > 0 && !(laws_at_rest(laws, x, k) && laws_at_rest(laws, x, k + rows - 1));
}

void laws_clear_pulls(const Laws *laws, double most, double x[]) {
    for (int k = 0; k < laws->size; k++) {
        x[k] = laws->width[k] == 0 && x[k] < 0.0 && -x[k] <= most ? 0.0 : x[k];
    }
}
