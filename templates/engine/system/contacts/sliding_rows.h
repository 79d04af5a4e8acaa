/* The rows that slide: how the unknowns answer forces along them, and these forces the unknowns. */
#ifndef SLIDING_ROWS_H
#define SLIDING_ROWS_H

#include "element_rows.h"

typedef struct {
    int count;
    int row[SIZE_FRICTIONAL];
    double answer[SIZE_FRICTIONAL][N_UNKNOWNS]; /* of the unknowns to a unit force along each */
} Sliding;

/* rows[N_FRICTIONAL]: those that slide in the present modes; returns how many there are. */
int sliding_find(const State *state, int rows[]);

/* Adds to forces[n] those along these rows that are in unknowns[n + m]. */
void sliding_push(const Instance *instance, double time, const double states[], const double inputs[],
                  const double unknowns[], double forces[]);

/* Where rows are redundant, makes the multipliers in unknowns[n + m] those of least norm: friction follows the loads
   that are shown. */
void sliding_share(const Instance *instance, const System *system, double unknowns[]);

/* Finds them and their answers; the system is factorised at the point. */
void sliding_evaluate(Instance *instance, const System *system, double time, const double states[],
                      const double inputs[], Sliding *sliding);

/* change[N_FRICTIONAL]: ds/dunknowns along a direction of the unknowns, and along a seed, of the forces s that the laws
   of friction demand. */
void sliding_change(const Instance *instance, double time, const double states[], const double inputs[],
                    const double unknowns[], const Seed *seed, const double along[], double change[]);

/* slope[count * count] of the equations z - s(unknowns) = 0 for the forces z, a row for each. */
void sliding_slope(const Instance *instance, double time, const double states[], const double inputs[],
                   const double unknowns[], const Sliding *sliding, double slope[]);

#endif
