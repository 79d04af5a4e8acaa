/* Vectors of LANES doubles: lane i of each belongs to run i of a group. Extensions of GCC and clang: arithmetic and
   comparisons go lane by lane, so that no lane knows of its neighbours. A Mask is all ones where something is true. */
#ifndef LANES_H
#define LANES_H

#include <stdbool.h>
#include <stdint.h>

#include "lane_sizes.h"

typedef double Lanes __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));

#ifdef __has_builtin
#define HAS_REDUCTION __has_builtin(__builtin_reduce_or)
#else
#define HAS_REDUCTION 0
#endif

#define LANE_FUNCTION static inline __attribute__((always_inline, unused))

/* The same number in all lanes; x - 0 is x, the sign of zero included. */
LANE_FUNCTION Lanes lanes_of(double x) {
    return x - (Lanes){0.0};
}

LANE_FUNCTION Mask lanes_bits(Lanes x) {
    union {
        Lanes numbers;
        Mask bits;
    } both = {x};
    return both.bits;
}

LANE_FUNCTION Lanes lanes_from_bits(Mask bits) {
    union {
        Mask bits;
        Lanes numbers;
    } both = {bits};
    return both.numbers;
}

/* a where the mask is set, b elsewhere. */
LANE_FUNCTION Lanes lanes_select(Mask mask, Lanes a, Lanes b) {
    return lanes_from_bits((lanes_bits(a) & mask) | (lanes_bits(b) & ~mask));
}

LANE_FUNCTION bool lanes_any(Mask mask) {
#if HAS_REDUCTION
    return __builtin_reduce_or(mask) != 0;
#else
    int64_t any = 0;
    for (int i = 0; i < LANES; i++) {
        any |= mask[i];
    }
    return any != 0;
#endif
}

LANE_FUNCTION Lanes lanes_abs(Lanes x) {
    return lanes_from_bits(lanes_bits(x) & INT64_MAX);
}

LANE_FUNCTION Lanes lanes_min(Lanes a, Lanes b) {
    return lanes_select(a < b, a, b);
}

LANE_FUNCTION Lanes lanes_max(Lanes a, Lanes b) {
    return lanes_select(a > b, a, b);
}

/* Writes a value to the lanes of a mask. */
LANE_FUNCTION void lanes_put(Lanes *place, Mask mask, Lanes value) {
    *place = lanes_select(mask, value, *place);
}

#endif
