/* Sparse linear equations by elimination within an envelope: row i and column i begin at first[i]. */
#ifndef ENVELOPE_H
#define ENVELOPE_H

#include <stdbool.h>

#include "arena.h"

/* lower[offset[i] + j] is entry (i, j) for j < i, upper[offset[i] + j] is entry (j, i) for j <= i; j >= first[i]. */
typedef struct {
    int size;
    const int *first;  /* [size], of the caller, by which the envelope is symmetric */
    const int *offset; /* [size] */
    double *lower;
    double *upper;
} Envelope;

/* Bytes of an envelope, for a reservation. */
size_t envelope_bytes(int size, const int first[]);

/* An envelope of the arena that begins there, with undefined entries. */
Envelope envelope_take(Arena *arena, int size, const int first[]);

/* All entries become 0. */
void envelope_clear(const Envelope *envelope);

/* Where entry (i, j) within the envelope is stored. */
double *envelope_entry(const Envelope *envelope, int i, int j);

/* Overwrites the entries by L and U, the diagonal entries of L being 1 and not stored, without pivoting. False: a pivot
   is less than least. George, Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981, chapter 4. */
bool envelope_factorize(const Envelope *envelope, double least);

/* Overwrites b[size] by the solution. */
void envelope_solve(const Envelope *envelope, double b[]);

#endif
