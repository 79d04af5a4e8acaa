/* Singular value decomposition by one-sided Jacobi rotations. */
#include "least_norm.h"

#include <math.h>
#include <stdbool.h>

#include "mechanism.h"

enum { R = SIZE_ROWS, MAX_SWEEPS = 60 };

/* A singular value of this part of the largest one is rounding error. Those of a Delassus matrix are squares of
   distances between rows: its rank is decided as constraint_factorization.c decides that of the constraints. */
static const double RANK_TOLERANCE = 1e-10;

/* Columns whose cosine is smaller are orthogonal. */
static const double ORTHOGONAL = 1e-15;

/* a V = W with orthogonal columns. The columns of W and V are stored as rows. */
typedef struct {
    int n;
    double image[R * R];
    double basis[R * R];
    double square[R]; /* of the singular values; 0: below the tolerance */
} Decomposition;

static double inner_product(const double a[], const double b[], int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static void rotate(double a[], double b[], int count, double cosine, double sine) {
    for (int i = 0; i < count; i++) {
        const double first = a[i];
        a[i] = cosine * first - sine * b[i];
        b[i] = sine * first + cosine * b[i];
    }
}

/* Makes two columns of W orthogonal; returns whether they were. */
static bool orthogonalise(Decomposition *d, int p, int q) {
    const int n = d->n;
    double *a = d->image + p * n, *b = d->image + q * n;
    const double aa = inner_product(a, a, n), bb = inner_product(b, b, n), ab = inner_product(a, b, n);
    if (fabs(ab) <= ORTHOGONAL * sqrt(aa) * sqrt(bb)) {
        return true;
    }
    const double zeta = (bb - aa) / (2.0 * ab);
    const double tangent = (zeta >= 0.0 ? 1.0 : -1.0) / (fabs(zeta) + sqrt(1.0 + zeta * zeta));
    const double cosine = 1.0 / sqrt(1.0 + tangent * tangent);
    rotate(a, b, n, cosine, cosine * tangent);
    rotate(d->basis + p * n, d->basis + q * n, n, cosine, cosine * tangent);
    return false;
}

static void decompose(Decomposition *d, int n, const double a[]) {
    d->n = n;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            d->image[j * n + i] = a[i * n + j];
            d->basis[j * n + i] = i == j ? 1.0 : 0.0;
        }
    }
    bool done = false;
    for (int sweep = 0; sweep < MAX_SWEEPS && !done; sweep++) {
        done = true;
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                done = orthogonalise(d, p, q) && done;
            }
        }
    }
    double largest = 0.0;
    for (int j = 0; j < n; j++) {
        d->square[j] = inner_product(d->image + j * n, d->image + j * n, n);
        largest = fmax(largest, d->square[j]);
    }
    for (int j = 0; j < n; j++) {
        d->square[j] = d->square[j] > RANK_TOLERANCE * RANK_TOLERANCE * largest ? d->square[j] : 0.0;
    }
}

/* x += V W^+ b */
static void add_solution(const Decomposition *d, const double b[], double x[]) {
    for (int j = 0; j < d->n; j++) {
        if (d->square[j] > 0.0) {
            const double part = inner_product(d->image + j * d->n, b, d->n) / d->square[j];
            for (int i = 0; i < d->n; i++) {
                x[i] += part * d->basis[j * d->n + i];
            }
        }
    }
}

void least_norm_solve(int n, const double a[], const double b[], double x[]) {
    Decomposition d;
    double rest[R];
    decompose(&d, n, a);
    for (int i = 0; i < n; i++) {
        x[i] = 0.0;
    }
    for (int refinement = 0; refinement < 2; refinement++) {
        for (int i = 0; i < n; i++) {
            rest[i] = b[i] - inner_product(a + i * n, x, n);
        }
        add_solution(&d, rest, x);
    }
}
