/* Elimination within an envelope: all inner loops run along stored rows of L and columns of U. */
#include "envelope.h"

#include <math.h>
#include <string.h>

static size_t entries_of(int size, const int first[]) {
    size_t entries = 0;
    for (int i = 0; i < size; i++) {
        entries += (size_t)(i + 1 - first[i]);
    }
    return entries;
}

size_t envelope_bytes(int size, const int first[]) {
    return arena_bytes((size_t)size, sizeof(int)) + 2 * arena_bytes(entries_of(size, first), sizeof(double));
}

Envelope envelope_take(Arena *arena, int size, const int first[]) {
    const size_t bytes = entries_of(size, first) * sizeof(double);
    int *offset = (int *)arena_take(arena, (size_t)size * sizeof(int));
    for (int i = 0, entries = 0; i < size; i++) {
        offset[i] = entries - first[i];
        entries += i + 1 - first[i];
    }
    return (Envelope){size, first, offset, (double *)arena_take(arena, bytes), (double *)arena_take(arena, bytes)};
}

void envelope_clear(const Envelope *e) {
    const size_t bytes = entries_of(e->size, e->first) * sizeof(double);
    memset(e->lower, 0, bytes);
    memset(e->upper, 0, bytes);
}

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
