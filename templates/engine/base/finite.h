/* One question about many numbers, asked at each stage of the solver. */
#ifndef FINITE_H
#define FINITE_H

#include <stdbool.h>

/* Are all values finite? 0 times an infinity or a NaN is NaN, and a sum with a NaN is NaN: no branch for each value. */
static inline bool all_finite(const double values[], int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += 0.0 * values[i];
    }
    return sum == 0.0;
}

#endif
