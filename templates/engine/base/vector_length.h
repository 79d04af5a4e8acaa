/* The length of a vector of slips or of friction. */
#ifndef VECTOR_LENGTH_H
#define VECTOR_LENGTH_H

#include <math.h>

/* Of v[count]. The same bits on every platform, which hypot() does not promise. */
static inline double vector_length(const double v[], int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += v[i] * v[i];
    }
    return sqrt(sum);
}

/* The greatest magnitude of v[count]. */
static inline double vector_greatest(const double v[], int count) {
    double greatest = 0.0;
    for (int i = 0; i < count; i++) {
        greatest = fmax(greatest, fabs(v[i]));
    }
    return greatest;
}

#endif
