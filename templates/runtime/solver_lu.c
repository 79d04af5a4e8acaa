/* Crout's order of Gaussian elimination, row by row. */
#include "solver_lu.h"

#include <math.h>

static void swap_rows(double a[], int rows[], int size, int i, int k) {
    const int kept = rows[i];
    rows[i] = rows[k];
    rows[k] = kept;
    for (int j = 0; j < size; j++) {
        const double entry = a[i * size + j];
        a[i * size + j] = a[k * size + j];
        a[k * size + j] = entry;
    }
}

bool lu_factorize(double a[], int rows[], int size) {
    for (int i = 0; i < size; i++) {
        rows[i] = i;
    }
    for (int k = 0; k < size; k++) {
        int best = k;
        for (int i = k + 1; i < size; i++) {
            best = fabs(a[i * size + k]) > fabs(a[best * size + k]) ? i : best;
        }
        if (best != k) {
            swap_rows(a, rows, size, best, k);
        }
        const double pivot = a[k * size + k];
        if (!(fabs(pivot) > 0.0) || !isfinite(pivot)) {
            return false;
        }
        for (int i = k + 1; i < size; i++) {
            const double factor = a[i * size + k] / pivot;
            a[i * size + k] = factor;
            for (int j = k + 1; j < size && factor != 0.0; j++) {
                a[i * size + j] -= factor * a[k * size + j];
            }
        }
    }
    return true;
}

void lu_solve(const double a[], const int rows[], int size, const double b[], double x[]) {
    for (int i = 0; i < size; i++) {
        x[i] = b[rows[i]];
        for (int j = 0; j < i; j++) {
            x[i] -= a[i * size + j] * x[j];
        }
    }
    for (int i = size - 1; i >= 0; i--) {
        for (int j = i + 1; j < size; j++) {
            x[i] -= a[i * size + j] * x[j];
        }
        x[i] /= a[i * size + i];
    }
}
