#include "orthogonal.h"

#include <math.h>
#include <string.h>

#include "scale.h"

static double inner(int size, const double a[], const double b[]) {
    double sum = 0.0;
    for (int i = 0; i < size; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static void reflect(int size, const double v[], double x[]) {
    const double along = inner(size, v, x);
    for (int i = 0; i < size; i++) {
        x[i] -= along * v[i];
    }
}

/* The v that takes x to a multiple of the first axis, which is returned. Nothing may be reflected where x is 0. */
static double reflector_of(int size, const double x[], double v[]) {
    const double length = sqrt(inner(size, x, x));
    const double scale = length > 0.0 ? 1.0 / sqrt(length * (length + fabs(x[0]))) : 0.0;
    const double taken = x[0] > 0.0 ? -length : length;
    for (int i = 0; i < size; i++) {
        v[i] = (x[i] - (i == 0 ? taken : 0.0)) * scale;
    }
    return taken;
}

void lower_triangular(int rows, int columns, double a[]) {
    for (int i = 0; i < rows; i++) {
        double *row = a + i * columns;
        const double taken = reflector_of(columns - i, row + i, row + i);
        for (int k = i + 1; k < rows; k++) {
            double *below = a + k * columns;
            reflect(columns - i, row + i, below + i);
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
            reflect(columns - i, reflectors + i * columns + i, row + i);
        }
        double *rest = row + count;
        if (inner(columns - count, rest, rest) <= REDUNDANT) {
            continue;
        }
        double *v = reflectors + count * columns;
        memset(v, 0, (size_t)columns * sizeof(double));
        rest[0] = reflector_of(columns - count, rest, v + count);
        kept[count++] = j;
    }
    return count;
}

void turn_back(int count, int columns, const double reflectors[], double x[]) {
    for (int i = count - 1; i >= 0; i--) {
        reflect(columns - i, reflectors + i * columns + i, x + i);
    }
}
