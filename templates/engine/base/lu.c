/* Crout's order of Gaussian elimination, row by row. */
#include "lu.h"

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
        const double pivot = a[k * size + k], inverse = 1.0 / pivot;
        if (!isfinite(pivot) || !isfinite(inverse)) {
            return false;
        }
        a[k * size + k] = inverse;
        for (int i = k + 1; i < size; i++) {
            const double factor = a[i * size + k] * inverse;
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
        double sum = b[rows[i]];
        for (int j = 0; j < i; j++) {
            sum -= a[i * size + j] * x[j];
        }
        x[i] = sum;
    }
    for (int i = size - 1; i >= 0; i--) {
        double sum = x[i];
        for (int j = i + 1; j < size; j++) {
            sum -= a[i * size + j] * x[j];
        }
        x[i] = sum * a[i * size + i];
    }
}
