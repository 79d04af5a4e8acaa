#include "orthogonal.h"

#include <math.h>
#include <string.h>

#include "restrict.h"
#include "scale.h"

static double inner(int size, const double a[], const double b[]) {
    double sum = 0.0;
    for (int i = 0; i < size; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* x becomes (1 - factor v v^T) x. */
static void reflect(int size, double factor, const double *RESTRICT v, double *RESTRICT x) {
    const double along = factor * inner(size, v, x);
    for (int i = 0; i < size; i++) {
        x[i] -= along * v[i];
    }
}

/* x becomes the v, with its factor, that takes x to a multiple of the first axis, which is returned. The factor is 0
   where x is. */
static double make_reflector(int size, double x[], double *factor) {
    const double length = sqrt(inner(size, x, x));
    const double taken = x[0] > 0.0 ? -length : length;
    x[0] -= taken;
    *factor = length > 0.0 ? 1.0 / (length * fabs(x[0])) : 0.0;
    return taken;
}

void lower_triangular(int rows, int columns, double a[]) {
    for (int i = 0; i < rows; i++) {
        double *row = a + i * columns, factor;
        const double taken = make_reflector(columns - i, row + i, &factor);
        for (int k = i + 1; k < rows; k++) {
            double *below = a + k * columns;
            reflect(columns - i, factor, row + i, below + i);
            below[i] = taken < 0.0 ? -below[i] : below[i];
        }
        memset(row + i, 0, (size_t)(columns - i) * sizeof(double));
        row[i] = fabs(taken);
    }
}

int reduce_rows(int rows, int columns, double a[], double reflectors[], int kept[]) {
    int count = 0;
    for (int j = 0; j < rows && count < columns; j++) {
        double *row = a + j * columns;
        for (int i = 0; i < count; i++) {
            reflect(columns - i, 1.0, reflectors + i * columns + i, row + i);
        }
        double *rest = row + count;
        if (inner(columns - count, rest, rest) <= REDUNDANT) {
            continue;
        }
        double *v = reflectors + count * columns;
        double factor;
        memset(v, 0, (size_t)count * sizeof(double));
        memcpy(v + count, rest, (size_t)(columns - count) * sizeof(double));
        rest[0] = make_reflector(columns - count, v + count, &factor);
        factor = sqrt(factor);
        for (int i = count; i < columns; i++) {
            v[i] *= factor;
        }
        kept[count++] = j;
    }
    return count;
}

void turn_back(int count, int columns, const double reflectors[], double x[]) {
    for (int i = count - 1; i >= 0; i--) {
        reflect(columns - i, 1.0, reflectors + i * columns + i, x + i);
    }
}
