/* A complete orthogonal decomposition: A P = Q (T 0) Z by reflections from the left with exchanges of columns, and from
   the right where the rank is less than n. */
#include "least_norm.h"

#include <math.h>
#include <string.h>

#include "scale.h"

/* Column k of Q's reflections stands in column k from the diagonal on, row k of Z's in row k: in its place on the
   diagonal, which T has in diagonal[], and from the rank on. */
typedef struct {
    int n;
    int rank;
    double *entry; /* [n * n]; the next ones [n] */
    double *diagonal;
    double *left;  /* 2 / v^T v of the reflections 1 - left v v^T */
    double *right; /* 2 / v^T v of the reflections from the right, which make Z */
    double *head;  /* the first component of Z's v */
    double *sums;  /* memory */
    int *column;   /* place -> column of A */
} Decomposition;

static double column_square(const Decomposition *d, int first, int j) {
    double sum = 0.0;
    for (int i = first; i < d->n; i++) {
        sum += d->entry[i * d->n + j] * d->entry[i * d->n + j];
    }
    return sum;
}

/* Brings the longest remaining column to place k; returns its squared length. */
static double bring_column(Decomposition *d, int k) {
    int best = k;
    double longest = -1.0;
    for (int j = k; j < d->n; j++) {
        const double square = column_square(d, k, j);
        best = square > longest ? j : best;
        longest = fmax(longest, square);
    }
    for (int i = 0; i < d->n; i++) {
        const double kept = d->entry[i * d->n + k];
        d->entry[i * d->n + k] = d->entry[i * d->n + best];
        d->entry[i * d->n + best] = kept;
    }
    const int column = d->column[k];
    d->column[k] = d->column[best];
    d->column[best] = column;
    return longest;
}

/* Reflects column k onto the diagonal, and the columns behind with it. The sums run along rows. */
static void reflect_column(Decomposition *d, int k, double square) {
    const int n = d->n;
    double *pivot = &d->entry[k * n + k];
    double *sums = d->sums;
    memset(sums, 0, (size_t)n * sizeof(double));
    d->diagonal[k] = *pivot > 0.0 ? -sqrt(square) : sqrt(square);
    *pivot -= d->diagonal[k];
    d->left[k] = 2.0 / column_square(d, k, k);
    for (int i = k; i < n; i++) {
        for (int j = k + 1; j < n; j++) {
            sums[j] += d->entry[i * n + k] * d->entry[i * n + j];
        }
    }
    for (int i = k; i < n; i++) {
        for (int j = k + 1; j < n; j++) {
            d->entry[i * n + j] -= d->left[k] * d->entry[i * n + k] * sums[j];
        }
    }
}

/* Reflects what row k has behind the rank onto the diagonal, and the rows above with it. */
static void reflect_row(Decomposition *d, int k) {
    const int n = d->n;
    const double *row = d->entry + k * n;
    double square = d->diagonal[k] * d->diagonal[k];
    for (int j = d->rank; j < n; j++) {
        square += row[j] * row[j];
    }
    const double length = d->diagonal[k] > 0.0 ? -sqrt(square) : sqrt(square);
    d->head[k] = d->diagonal[k] - length;
    d->right[k] = 1.0 / (square - length * d->diagonal[k]);
    d->diagonal[k] = length;
    for (int i = 0; i < k; i++) {
        double *above = d->entry + i * n;
        double sum = d->head[k] * above[k];
        for (int j = d->rank; j < n; j++) {
            sum += row[j] * above[j];
        }
        above[k] -= d->right[k] * sum * d->head[k];
        for (int j = d->rank; j < n; j++) {
            above[j] -= d->right[k] * sum * row[j];
        }
    }
}

static Decomposition take_decomposition(Arena *arena, int n) {
    const size_t bytes = (size_t)n * sizeof(double);
    return (Decomposition){.n = n,
                           .entry = (double *)arena_take(arena, (size_t)n * bytes),
                           .diagonal = (double *)arena_take(arena, bytes),
                           .left = (double *)arena_take(arena, bytes),
                           .right = (double *)arena_take(arena, bytes),
                           .head = (double *)arena_take(arena, bytes),
                           .sums = (double *)arena_take(arena, bytes),
                           .column = (int *)arena_take(arena, (size_t)n * sizeof(int))};
}

static void decompose(Decomposition *d, const double a[]) {
    const int n = d->n;
    double least = 0.0;
    memcpy(d->entry, a, (size_t)(n * n) * sizeof(double));
    for (int k = 0; k < n; k++) {
        d->column[k] = k;
    }
    for (d->rank = 0; d->rank < n; d->rank++) {
        const double square = bring_column(d, d->rank);
        least = d->rank == 0 ? REDUNDANT * sqrt(square) : least;
        if (!(sqrt(square) > least)) {
            break;
        }
        reflect_column(d, d->rank, square);
    }
    for (int k = d->rank - 1; k >= 0 && d->rank < n; k--) {
        reflect_row(d, k);
    }
}

/* Overwrites b[n] by Q^T b. */
static void turn_right_side(const Decomposition *d, double b[]) {
    for (int k = 0; k < d->rank; k++) {
        double sum = 0.0;
        for (int i = k; i < d->n; i++) {
            sum += d->entry[i * d->n + k] * b[i];
        }
        for (int i = k; i < d->n; i++) {
            b[i] -= d->left[k] * sum * d->entry[i * d->n + k];
        }
    }
}

/* x += the solution for the right side b[n], which is overwritten. */
static void add_solution(const Decomposition *d, double b[], double x[]) {
    const int n = d->n;
    turn_right_side(d, b);
    for (int k = d->rank - 1; k >= 0; k--) {
        for (int j = k + 1; j < d->rank; j++) {
            b[k] -= d->entry[k * n + j] * b[j];
        }
        b[k] /= d->diagonal[k];
    }
    for (int k = d->rank; k < n; k++) {
        b[k] = 0.0;
    }
    for (int k = 0; k < d->rank && d->rank < n; k++) {
        const double *row = d->entry + k * n;
        double sum = d->head[k] * b[k];
        for (int j = d->rank; j < n; j++) {
            sum += row[j] * b[j];
        }
        b[k] -= d->right[k] * sum * d->head[k];
        for (int j = d->rank; j < n; j++) {
            b[j] -= d->right[k] * sum * row[j];
        }
    }
    for (int k = 0; k < n; k++) {
        x[d->column[k]] += b[k];
    }
}

void least_norm_solve(Arena *arena, int n, const double a[], const double b[], double x[]) {
    if (n == 1) {
        x[0] = a[0] != 0.0 ? b[0] / a[0] : 0.0;
        return;
    }
    const ArenaMark mark = arena_mark(arena);
    Decomposition d = take_decomposition(arena, n);
    double *rest = (double *)arena_take(arena, (size_t)n * sizeof(double));
    decompose(&d, a);
    memset(x, 0, (size_t)n * sizeof(double));
    for (int refinement = 0; refinement < 2; refinement++) {
        for (int i = 0; i < n; i++) {
            rest[i] = b[i];
            for (int j = 0; j < n; j++) {
                rest[i] -= a[i * n + j] * x[j];
            }
        }
        add_solution(&d, rest, x);
    }
    arena_release(mark);
}

/* y[n] = column k of Q. From the rank on y^T a = 0. */
static void column_of_left(const Decomposition *d, int k, double y[]) {
    memset(y, 0, (size_t)d->n * sizeof(double));
    y[k] = 1.0;
    for (int j = d->rank - 1; j >= 0; j--) {
        double sum = 0.0;
        for (int i = j; i < d->n; i++) {
            sum += d->entry[i * d->n + j] * y[i];
        }
        for (int i = j; i < d->n; i++) {
            y[i] -= d->left[j] * sum * d->entry[i * d->n + j];
        }
    }
}

void even_solve(Arena *arena, int n, double a[], double b[], double x[]) {
    const ArenaMark mark = arena_mark(arena);
    Decomposition d = take_decomposition(arena, n);
    double *y = (double *)arena_take(arena, (size_t)n * sizeof(double));
    decompose(&d, a);
    for (int k = d.rank; k < n; k++) {
        double part = 0.0;
        column_of_left(&d, k, y);
        for (int i = 0; i < n; i++) {
            part += y[i] * b[i];
        }
        for (int i = 0; i < n; i++) {
            b[i] -= part * y[i];
            for (int j = 0; j < n; j++) {
                a[i * n + j] += y[i] * y[j];
            }
        }
    }
    arena_release(mark);
    least_norm_solve(arena, n, a, b, x);
}
