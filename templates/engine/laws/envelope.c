/* Elimination within an envelope: all inner loops run along stored rows of L and columns of U. */
#include "envelope.h"

#include <math.h>

double *envelope_entry(const Envelope *envelope, int i, int j) {
    return j < i ? envelope->lower + envelope->offset[i] + j : envelope->upper + envelope->offset[j] + i;
}

/* The sum of row i of L times column j of U, up to place end. */
static double product_of_rows(const Envelope *e, int i, int j, int end) {
    const int start = e->first[i] > e->first[j] ? e->first[i] : e->first[j];
    const double *row = e->lower + e->offset[i], *column = e->upper + e->offset[j];
    double sum = 0.0;
    for (int k = start; k < end; k++) {
        sum += row[k] * column[k];
    }
    return sum;
}

bool envelope_factorize(const Envelope *e, double least) {
    bool regular = true;
    for (int i = 0; i < e->size && regular; i++) {
        for (int j = e->first[i]; j < i; j++) {
            *envelope_entry(e, j, i) -= product_of_rows(e, j, i, j);
            double *entry = envelope_entry(e, i, j);
            *entry = (*entry - product_of_rows(e, i, j, j)) / *envelope_entry(e, j, j);
        }
        double *pivot = envelope_entry(e, i, i);
        *pivot -= product_of_rows(e, i, i, i);
        regular = fabs(*pivot) >= least;
    }
    return regular;
}

void envelope_solve(const Envelope *e, double b[]) {
    for (int i = 0; i < e->size; i++) {
        for (int j = e->first[i]; j < i; j++) {
            b[i] -= *envelope_entry(e, i, j) * b[j];
        }
    }
    for (int i = e->size - 1; i >= 0; i--) {
        b[i] /= *envelope_entry(e, i, i);
        for (int j = e->first[i]; j < i; j++) {
            b[j] -= *envelope_entry(e, j, i) * b[i];
        }
    }
}
