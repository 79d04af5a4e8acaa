/* Sizes that follow from those of the mechanism. */
#ifndef SIZES_H
#define SIZES_H

#include "mechanism.h"

#define N_RATES (N_STATES - N_COORDINATES) /* accelerations, and behind them the derivatives of further states */
#define N_MOVING (N_STATES - N_RESTING)          /* those that solvers integrate */
#define N_FURTHER (N_STATES - 2 * N_COORDINATES)
#define SIZE_FURTHER (N_FURTHER > 0 ? N_FURTHER : 1)

enum { MAX_INPUT_ORDER = 3 }; /* the highest time derivatives taken */

/* Short names for the code, as its comments use them. */
enum { N = N_COORDINATES, K = N_CONSTRAINTS, R = N_RATES };

#endif
