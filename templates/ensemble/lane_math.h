/* Elementary functions in lanes: sin, cos, exp and log with errors below 1 unit in the last place, without branches
   where arguments are usual. Lanes with unusual ones (huge, not finite, near the ends of the range) are computed by the
   C library, and the others do not notice. All other functions call the C library lane by lane.

   Source of the polynomials and of the splitting of pi/2 and ln 2: FreeBSD's msun (k_sin.c, k_cos.c, e_rem_pio2.c,
   e_exp.c, e_log.c), Copyright 1993 and 2004 by Sun Microsystems, which permits use with this notice; arguments are
   reduced as W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980, chapter 8. */
#ifndef LANE_MATH_H
#define LANE_MATH_H

#include <math.h>

#include "lanes.h"

static const double HUGE_ANGLE = 1e6; /* rad; Payne and Hanek's method is that of the C library */
static const double LARGE_EXPONENT = 708.0;
static const double ROUNDER = 6755399441055744.0; /* 1.5 * 2^52: adding it leaves the nearest integer in the low bits */

/* result = function(x) of the C library in the lanes of the mask, fast in the others. */
static __attribute__((noinline, unused)) Lanes lanes_by_library(double (*function)(double), Mask mask, Lanes x,
                                                                Lanes fast) {
    for (int i = 0; i < LANES; i++) {
        if (mask[i]) {
            fast[i] = function(x[i]);
        }
    }
    return fast;
}

LANE_FUNCTION Lanes lanes_library(double (*function)(double), Lanes x) {
    for (int i = 0; i < LANES; i++) {
        x[i] = function(x[i]);
    }
    return x;
}

LANE_FUNCTION Lanes lanes_library_2(double (*function)(double, double), Lanes x, Lanes y) {
    for (int i = 0; i < LANES; i++) {
        x[i] = function(x[i], y[i]);
    }
    return x;
}

/* An angle is quarters * pi/2 + high + low, |high| <= pi/4. */
typedef struct {
    Lanes high, low;
    Mask quarters; /* modulo 4 in the two lowest bits */
} Reduced;

#if (defined(__FMA__) || defined(__ARM_FEATURE_FMA)) && defined(__clang__)
/* A product that is added to is not rounded: a fraction of pi/2 with all its bits takes three steps. */
LANE_FUNCTION Reduced reduced_angle(Lanes x) {
    const Lanes shifted = x * 6.36619772367581382433e-01 + ROUNDER;
    const Lanes n = shifted - ROUNDER;
    const Lanes first = __builtin_elementwise_fma(-n, lanes_of(1.57079632679489655800e+00), x); /* exact */
    const Lanes product = n * 6.12323399573676603587e-17;
    const Lanes rest = __builtin_elementwise_fma(n, lanes_of(6.12323399573676603587e-17), -product);
    const Lanes second = first - product, part = first - second;
    const Lanes other = (first - (second + part)) + (part - product);
    const Lanes small = (other - rest) - n * -1.49738490485916983e-33;
    const Lanes high = second + small;
    return (Reduced){high, (second - high) + small, lanes_bits(shifted)};
}
#else
/* a - b = *difference + the result, exactly. Knuth, volume 2, section 4.2.2, theorem B. */
LANE_FUNCTION Lanes rest_of_difference(Lanes a, Lanes b, Lanes *difference) {
    *difference = a - b;
    const Lanes part = a - *difference;
    return (a - (*difference + part)) + (part - b);
}

LANE_FUNCTION Reduced reduced_angle(Lanes x) {
    const Lanes shifted = x * 6.36619772367581382433e-01 + ROUNDER;
    const Lanes n = shifted - ROUNDER;
    const Lanes first = x - n * 1.57079632673412561417e+00; /* 33 bits each: products with n are exact */
    Lanes second, third;
    const Lanes rest = rest_of_difference(first, n * 6.07710050630396597660e-11, &second);
    const Lanes other = rest_of_difference(second, n * 2.02226624871116645580e-21, &third);
    const Lanes small = (rest + other) - n * 8.47842766036889956997e-32;
    const Lanes high = third + small;
    return (Reduced){high, (third - high) + small, lanes_bits(shifted)};
}
#endif

#ifdef __clang__
#pragma clang fp contract(fast) /* the polynomials; nothing here has to be rounded in between */
#endif
LANE_FUNCTION Lanes sin_of_reduced(Reduced r) {
    const Lanes x = r.high, z = x * x, v = z * x;
    const Lanes tail =
        8.33333333332248946124e-03 +
        z * (-1.98412698298579493134e-04 +
             z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
    return x - ((z * (0.5 * r.low - v * tail) - r.low) + v * 1.66666666666666324348e-01);
}

LANE_FUNCTION Lanes cos_of_reduced(Reduced r) {
    const Lanes x = r.high, z = x * x, w = z * z;
    const Lanes tail =
        z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05)) +
        w * w * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
    const Lanes half = 0.5 * z, near = 1.0 - half;
    return near + (((1.0 - near) - half) + (z * tail - x * r.low));
}

#ifdef __clang__
#pragma clang fp contract(off)
#endif
/* sin(r + quarters pi/2) */
LANE_FUNCTION Lanes sin_of_quarters(Reduced r, Mask quarters) {
    const Mask odd = -(quarters & 1), sign = (quarters & 2) << 62;
    const Lanes value = lanes_select(odd, cos_of_reduced(r), sin_of_reduced(r));
    return lanes_from_bits(lanes_bits(value) ^ sign);
}

LANE_FUNCTION Lanes lanes_sin(Lanes x) {
    const Reduced r = reduced_angle(x);
    const Lanes fast = lanes_select(x == 0.0, x, sin_of_quarters(r, r.quarters)); /* the sign of zero stays */
    const Mask unusual = ~(Mask)(lanes_abs(x) <= HUGE_ANGLE);
    return __builtin_expect(lanes_any(unusual), 0) ? lanes_by_library(sin, unusual, x, fast) : fast;
}

LANE_FUNCTION Lanes lanes_cos(Lanes x) {
    const Reduced r = reduced_angle(x);
    const Lanes fast = sin_of_quarters(r, r.quarters + 1);
    const Mask unusual = ~(Mask)(lanes_abs(x) <= HUGE_ANGLE);
    return __builtin_expect(lanes_any(unusual), 0) ? lanes_by_library(cos, unusual, x, fast) : fast;
}

LANE_FUNCTION Lanes lanes_exp(Lanes x) {
    const Lanes shifted = x * 1.44269504088896338700e+00 + ROUNDER;
    const Lanes n = shifted - ROUNDER;
    const Lanes high = x - n * 6.93147180369123816490e-01, low = n * 1.90821492927058770002e-10;
    const Lanes r = high - low, z = r * r;
    const Lanes c =
        r - z * (1.66666666666666019037e-01 +
                 z * (-2.77777777770155933842e-03 +
                      z * (6.61375632143793436117e-05 +
                           z * (-1.65339022054652515390e-06 + z * 4.13813679705723846039e-08))));
    const Lanes value = 1.0 - ((low - (r * c) / (2.0 - c)) - high);
    const Lanes fast = lanes_from_bits(lanes_bits(value) + (lanes_bits(shifted) << 52));
    const Mask unusual = ~(Mask)(lanes_abs(x) <= LARGE_EXPONENT);
    return __builtin_expect(lanes_any(unusual), 0) ? lanes_by_library(exp, unusual, x, fast) : fast;
}

LANE_FUNCTION Lanes lanes_log(Lanes x) {
    static const int64_t ROOT = 0x3fe6a09e00000000; /* the high bits of sqrt(1/2), where the mantissa begins */
    const Mask bits = lanes_bits(x) + (0x3ff0000000000000 - ROOT);
    const Mask exponent = (bits >> 52) - 0x3ff;
    const Lanes n = lanes_from_bits(exponent + 0x4338000000000000) - ROUNDER;
    const Lanes f = lanes_from_bits((bits & 0x000fffffffffffff) + ROOT) - 1.0;
    const Lanes half = 0.5 * f * f, s = f / (2.0 + f), z = s * s, w = z * z;
    const Lanes even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
    const Lanes odd = z * (6.666666666666735130e-01 +
                           w * (2.857142874366239149e-01 +
                                w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
    const Lanes fast =
        n * 6.93147180369123816490e-01 - ((half - (s * (half + (even + odd)) + n * 1.90821492927058770002e-10)) - f);
    const Mask unusual = ~(Mask)((x >= 2.2250738585072014e-308) & (x < HUGE_VAL));
    return __builtin_expect(lanes_any(unusual), 0) ? lanes_by_library(log, unusual, x, fast) : fast;
}

LANE_FUNCTION Lanes lanes_sqrt(Lanes x) {
    for (int i = 0; i < LANES; i++) {
        x[i] = sqrt(x[i]);
    }
    return x;
}

/* -1, 0 or 1. */
LANE_FUNCTION Lanes lanes_sign(Lanes x) {
    return lanes_select(x > 0.0, lanes_of(1.0), lanes_select(x < 0.0, lanes_of(-1.0), lanes_of(0.0)));
}

LANE_FUNCTION Lanes lanes_power_or_zero(Lanes x, Lanes exponent) {
    return lanes_select(x == 0.0, x * x, lanes_library_2(pow, x, exponent));
}

#endif
