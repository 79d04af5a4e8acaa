/* A value is carried as the sum of two numbers, and rounded once at the end. Sources: T. J. Dekker, A floating-point
   technique for extending the available precision, Numer. Math. 18 (1971) 224-242 (sums, products, quotients and roots
   of such pairs); W. J. Cody, W. Waite, Software Manual for the Elementary Functions, 1980 (reductions); M. Payne, R.
   Hanek, Radian reduction for trigonometric functions, SIGNUM 18 (1983) 19-24 (large angles); the intervals of atan are
   those of FreeBSD's msun. */
#include "own_math.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "own_constants.h"

static Pair sum_of(double a, double b) {
    const double sum = a + b, part = sum - a;
    return (Pair){sum, (a - (sum - part)) + (b - part)};
}

/* The same where |a| >= |b|. */
static Pair ordered_sum(double a, double b) {
    const double sum = a + b;
    return (Pair){sum, b - (sum - a)};
}

static Pair product_of(double a, double b) {
    const double product = a * b, p = SPLITTER * a, q = SPLITTER * b;
    const double a_high = p - (p - a), b_high = q - (q - b), a_low = a - a_high, b_low = b - b_high;
    return (Pair){product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

static Pair pair_sum(Pair a, Pair b) {
    const Pair high = sum_of(a.high, b.high), low = sum_of(a.low, b.low);
    const Pair nearly = ordered_sum(high.high, high.low + low.high);
    return ordered_sum(nearly.high, nearly.low + low.low);
}

static Pair pair_product(Pair a, Pair b) {
    const Pair high = product_of(a.high, b.high);
    return ordered_sum(high.high, high.low + (a.high * b.low + a.low * b.high));
}

static Pair pair_quotient(Pair a, Pair b) {
    const double first = a.high / b.high;
    const Pair taken = pair_product(b, (Pair){first, 0.0});
    const Pair rest = pair_sum(a, (Pair){-taken.high, -taken.low});
    return ordered_sum(first, rest.high / b.high);
}

static Pair pair_root(Pair a) {
    const double first = sqrt(a.high);
    const Pair square = product_of(first, first);
    const Pair rest = pair_sum(a, (Pair){-square.high, -square.low});
    return first > 0.0 ? ordered_sum(first, rest.high / (2.0 * first)) : (Pair){first, 0.0};
}

static Pair scaled(Pair a, int power) {
    return (Pair){ldexp(a.high, power), ldexp(a.low, power)};
}

static Pair opposite(Pair a) {
    return (Pair){-a.high, -a.low};
}

static double series_at(const double coefficients[], int count, double x) {
    double sum = 0.0;
    for (int i = count - 1; i >= 0; i--) {
        sum = coefficients[i] + x * sum;
    }
    return sum;
}

/* exp(r) - 1 for |r| <= ln(2)/2, by Taylor's series. */
static Pair small_exponential(Pair r) {
    const double x = r.high, tail = x * x * x * series_at(EXPONENTIAL, EXPONENTIAL_TERMS, x);
    return pair_sum(pair_sum(r, scaled(pair_product(r, r), -1)), (Pair){tail, 0.0});
}

/* exp(x) = result * 2^power. */
static Pair exponential(Pair x, int *power) {
    const double n = floor(x.high / LN_2[0] + 0.5);
    Pair r = sum_of(x.high, -n * LN_2[0]);
    r = pair_sum(r, (Pair){-n * LN_2[1], -n * LN_2[2]});
    *power = (int)n;
    return pair_sum((Pair){1.0, 0.0}, small_exponential(pair_sum(r, (Pair){x.low, 0.0})));
}

double own_exp(double x) {
    int power;
    if (!(x < MOST_EXPONENT)) {
        return x * HUGE_VAL; /* a NaN stays one */
    }
    if (x < LEAST_EXPONENT) {
        return 0.0;
    }
    const Pair found = exponential((Pair){x, 0.0}, &power);
    return ldexp(found.high + found.low, power);
}

/* ln(x) for x > 0: 2 atanh((m - 1) / (m + 1)) of the mantissa m, and the exponent's. */
static Pair logarithm(double x) {
    int power;
    double m = frexp(x, &power);
    if (m < ROOT_OF_HALF) {
        m *= 2.0;
        power--;
    }
    const Pair s = pair_quotient((Pair){m - 1.0, 0.0}, sum_of(m, 1.0)), z = pair_product(s, s);
    Pair sum = {series_at(LOGARITHM, LOGARITHM_TERMS, z.high), 0.0};
    for (int i = 2; i >= 0; i--) {
        sum = pair_sum(ODD_PARTS[i], pair_product(z, sum));
    }
    sum = scaled(pair_sum(s, pair_product(s, pair_product(z, sum))), 1);
    const double n = (double)power;
    sum = pair_sum(sum, (Pair){n * LN_2[1], n * LN_2[2]});
    return pair_sum((Pair){n * LN_2[0], 0.0}, sum);
}

double own_log(double x) {
    if (!(x > 0.0)) {
        return x == 0.0 ? -HUGE_VAL : (double)NAN;
    }
    if (x == HUGE_VAL) {
        return x;
    }
    const Pair found = logarithm(x);
    return found.high + found.low;
}

static bool is_odd(double whole) {
    return floor(0.5 * whole) != 0.5 * whole;
}

/* x^y of x >= 0. */
static double positive_power(double x, double y) {
    int power;
    if (x == 0.0 || x == HUGE_VAL) {
        return (x == 0.0) == (y > 0.0) ? 0.0 : HUGE_VAL;
    }
    if (fabs(y) == HUGE_VAL) {
        return x == 1.0 ? 1.0 : (x < 1.0) == (y > 0.0) ? 0.0 : HUGE_VAL;
    }
    const Pair l = logarithm(x);
    const double about = l.high * y;
    if (!(about < MOST_EXPONENT) || about < LEAST_EXPONENT) {
        return about > 0.0 ? HUGE_VAL : 0.0;
    }
    const Pair found = exponential(pair_product(l, (Pair){y, 0.0}), &power);
    return ldexp(found.high + found.low, power);
}

double own_pow(double x, double y) {
    if (y == 0.0 || x == 1.0) {
        return 1.0;
    }
    if (isnan(x) || isnan(y)) {
        return x + y;
    }
    const bool negative = copysign(1.0, x) < 0.0, whole = floor(y) == y;
    if (x < 0.0 && x > -HUGE_VAL && !whole) {
        return (double)NAN;
    }
    const double size = positive_power(fabs(x), y);
    return negative && whole && fabs(y) < HUGE_VAL && is_odd(y) ? -size : size;
}

/* exp(x) and exp(-x), halved, for x from 0 on. */
static void halves(double x, Pair *rising, Pair *falling) {
    int power;
    const Pair found = exponential((Pair){x, 0.0}, &power);
    *rising = scaled(found, power - 1);
    *falling = scaled(pair_quotient((Pair){1.0, 0.0}, found), -power - 1);
}

double own_sinh(double x) {
    const double size = fabs(x);
    Pair rising, falling, sum;
    if (!(size < MOST_HYPERBOLIC)) {
        return x * HUGE_VAL;
    }
    if (size < TINY) {
        return x;
    }
    if (size < SMALL_EXPONENT) {
        const Pair e = small_exponential((Pair){size, 0.0});
        sum = scaled(pair_sum(e, pair_quotient(e, pair_sum((Pair){1.0, 0.0}, e))), -1);
    } else {
        halves(size, &rising, &falling);
        sum = pair_sum(rising, opposite(falling));
    }
    return copysign(sum.high + sum.low, x);
}

double own_cosh(double x) {
    Pair rising, falling;
    if (!(fabs(x) < MOST_HYPERBOLIC)) {
        return fabs(x) * HUGE_VAL;
    }
    halves(fabs(x), &rising, &falling);
    const Pair sum = pair_sum(rising, falling);
    return sum.high + sum.low;
}

double own_tanh(double x) {
    const double size = fabs(x);
    int power;
    if (isnan(x) || size < TINY) {
        return x;
    }
    if (size > MOST_TANH) {
        return copysign(1.0, x);
    }
    if (2.0 * size < SMALL_EXPONENT) {
        const Pair e = small_exponential((Pair){2.0 * size, 0.0});
        const Pair found = pair_quotient(e, pair_sum(e, (Pair){2.0, 0.0}));
        return copysign(found.high + found.low, x);
    }
    const Pair square = exponential((Pair){2.0 * size, 0.0}, &power);
    const Pair part = pair_quotient((Pair){2.0, 0.0}, pair_sum(scaled(square, power), (Pair){1.0, 0.0}));
    const Pair found = pair_sum((Pair){1.0, 0.0}, opposite(part));
    return copysign(found.high + found.low, x);
}

enum { WINDOW = 6 }; /* words of 32 bits: of 2/pi that a large angle needs, and of its fraction of a quarter turn */

/* 2/pi = 0.b1 b2 b3 ... in words of 32 bits. */
static const uint32_t TWO_OVER_PI[] = {
    0xa2f9836eu, 0x4e441529u, 0xfc2757d1u, 0xf534ddc0u, 0xdb629599u, 0x3c439041u, 0xfe5163abu, 0xdebbc561u,
    0xb7246e3au, 0x424dd2e0u, 0x06492eeau, 0x09d1921cu, 0xfe1deb1cu, 0xb129a73eu, 0xe88235f5u, 0x2ebb4484u,
    0xe99c7026u, 0xb45f7e41u, 0x3991d639u, 0x835339f4u, 0x9c845f8bu, 0xbdf9283bu, 0x1ff897ffu, 0xde05980fu,
    0xef2f118bu, 0x5a0a6d1fu, 0x6d367ecfu, 0x27cb09b7u, 0x4f463f66u, 0x9e5fea2du, 0x7527bac7u, 0xebe5f17bu,
    0x3d0739f7u, 0x8a5292eau, 0x6bfb5fb1u, 0x1f8d5d08u, 0x56033046u, 0xfc7b6babu, 0xf0cfbc20u, 0x9af4361du
};
enum { PI_BITS = 32 * (int)(sizeof TWO_OVER_PI / sizeof TWO_OVER_PI[0]) };

static uint32_t bit_of_two_over_pi(int index) {
    return index < 0 || index >= PI_BITS ? 0 : (TWO_OVER_PI[index / 32] >> (31 - index % 32)) & 1u;
}

/* words[WINDOW], the first one being the highest: quarter turns of a large angle x > 0 modulo 4, times
   2^(32 WINDOW - 2). Bits of 2/pi that make whole turns are left out. */
static void turn_large_angle(double x, uint32_t words[]) {
    int exponent;
    const uint64_t mantissa = (uint64_t)ldexp(frexp(x, &exponent), DBL_MANT_DIG);
    const int first = exponent - DBL_MANT_DIG - 2;
    uint64_t carry = 0;
    for (int w = WINDOW - 1; w >= 0; w--) {
        uint32_t word = 0;
        for (int b = 0; b < 32; b++) {
            word = (word << 1) | bit_of_two_over_pi(first + 32 * w + b);
        }
        words[w] = word;
    }
    const uint64_t low = mantissa & 0xffffffffu, high = mantissa >> 32;
    uint32_t before = 0; /* the word behind the present one, for the upper half of the mantissa */
    for (int w = WINDOW - 1; w >= 0; w--) {
        const uint64_t one = low * words[w], other = high * before;
        const uint64_t sum = (one & 0xffffffffu) + (other & 0xffffffffu) + (carry & 0xffffffffu);
        carry = (one >> 32) + (other >> 32) + (carry >> 32) + (sum >> 32);
        before = words[w];
        words[w] = (uint32_t)sum;
    }
}

/* An angle x >= 0 as *quarters * pi/2 + the result, which is at most pi/4. */
static Pair reduced_large_angle(double x, int *quarters) {
    uint32_t words[WINDOW];
    Pair fraction = {0.0, 0.0};
    turn_large_angle(x, words);
    const bool up = (words[0] & 0x20000000u) != 0; /* more than half a quarter */
    *quarters = (int)((words[0] >> 30) + (up ? 1u : 0u)) & 3;
    for (int w = WINDOW - 1; w >= 0; w--) {
        const uint32_t word = (up ? ~words[w] : words[w]) & (w == 0 ? 0x3fffffffu : 0xffffffffu);
        for (int half = 0; half < 2; half++) {
            const double part = (double)((word >> (16 * half)) & 0xffffu);
            fraction = pair_sum((Pair){ldexp(part, 2 - 32 * (w + 1) + 16 * half), 0.0}, fraction);
        }
    }
    const Pair angle = pair_product(fraction, HALF_PI);
    return up ? opposite(angle) : angle;
}

/* An angle x >= 0 in the same parts. */
static Pair reduced_angle(double x, int *quarters) {
    if (x > LARGE_ANGLE) {
        return reduced_large_angle(x, quarters);
    }
    const double n = floor(x / HALF_PI.high + 0.5);
    Pair r = {x, 0.0};
    for (int i = 0; i < 4; i++) { /* products with all but the last part are exact */
        r = pair_sum(r, (Pair){-n * HALF_PI_PARTS[i], 0.0});
    }
    *quarters = (int)n & 3;
    return r;
}

static Pair sine_of_reduced(Pair r) {
    const double x = r.high, z = x * x, tail = x * z * series_at(SINE, SINE_TERMS, z);
    return ordered_sum(x, tail + r.low * (1.0 - 0.5 * z));
}

static Pair cosine_of_reduced(Pair r) {
    const Pair square = product_of(r.high, r.high);
    const double z = square.high, tail = z * z * series_at(COSINE, COSINE_TERMS, z) - r.high * r.low;
    const Pair near = ordered_sum(1.0, -0.5 * z);
    return ordered_sum(near.high, near.low + (tail - 0.5 * square.low));
}

/* sin(x + turned pi/2) for an angle x >= 0, rad. */
static double turned_sine(double x, int turned) {
    int quarters;
    const Pair r = reduced_angle(x, &quarters);
    const int whole = (quarters + turned) & 3;
    const Pair found = (whole & 1) != 0 ? cosine_of_reduced(r) : sine_of_reduced(r);
    const double value = found.high + found.low;
    return (whole & 2) != 0 ? -value : value;
}

double own_sin(double x) {
    if (!(fabs(x) < HUGE_VAL)) {
        return x - x;
    }
    return fabs(x) < TINY ? x : copysign(1.0, x) * turned_sine(fabs(x), 0);
}

double own_cos(double x) {
    return fabs(x) < HUGE_VAL ? turned_sine(fabs(x), 1) : x - x;
}

double own_tan(double x) {
    int quarters;
    if (!(fabs(x) < HUGE_VAL) || fabs(x) < TINY) {
        return fabs(x) < TINY ? x : x - x;
    }
    const Pair r = reduced_angle(fabs(x), &quarters), s = sine_of_reduced(r), c = cosine_of_reduced(r);
    const Pair found = (quarters & 1) != 0 ? opposite(pair_quotient(c, s)) : pair_quotient(s, c);
    return copysign(1.0, x) * (found.high + found.low);
}

/* atan(t) for t >= 0: near a known angle, or from a right angle down. */
static Pair arctangent(Pair t) {
    static const double CENTRES[] = {0.5, 1.0, 1.5};
    const double ENDS[] = {0.4375, 0.6875, 1.1875, 2.4375};
    Pair u = t, known = {0.0, 0.0};
    if (t.high >= ENDS[3]) {
        u = opposite(pair_quotient((Pair){1.0, 0.0}, t));
        known = HALF_PI;
    } else if (t.high >= ENDS[0]) {
        const int i = t.high < ENDS[1] ? 0 : t.high < ENDS[2] ? 1 : 2;
        const Pair turned = pair_sum((Pair){1.0, 0.0}, pair_product(t, (Pair){CENTRES[i], 0.0}));
        u = pair_quotient(pair_sum(t, (Pair){-CENTRES[i], 0.0}), turned);
        known = ANGLES[i];
    }
    const double z = u.high * u.high, rest = u.high * z * series_at(ARCTANGENT, ARCTANGENT_TERMS, z);
    return pair_sum(known, pair_sum(u, (Pair){-rest, 0.0}));
}

/* The angle of the point (x, y), y >= 0, of which neither is infinite and not both are 0. */
static double angle_of(Pair y, Pair x) {
    Pair found = HALF_PI;
    if (x.high != 0.0) {
        const Pair size = x.high < 0.0 ? opposite(x) : x;
        const double ratio = y.high / size.high;
        found = ratio > MOST_RATIO ? HALF_PI : arctangent(pair_quotient(y, size));
    }
    if (x.high < 0.0) {
        found = pair_sum(scaled(HALF_PI, 1), opposite(found));
    }
    return found.high + found.low;
}

double own_atan(double x) {
    if (isnan(x) || fabs(x) < TINY) {
        return x;
    }
    const double found = fabs(x) > MOST_RATIO ? HALF_PI.high : angle_of((Pair){fabs(x), 0.0}, (Pair){1.0, 0.0});
    return copysign(found, x);
}

/* The angle where an argument is 0, infinite or, beside the other one, as good as that. */
static double marginal_angle(double y, double x) {
    const bool ahead = copysign(1.0, x) > 0.0;
    if (y == HUGE_VAL && fabs(x) == HUGE_VAL) {
        return (ahead ? 0.5 : 1.5) * HALF_PI.high;
    }
    return y == HUGE_VAL ? HALF_PI.high : ahead ? 0.0 : 2.0 * HALF_PI.high;
}

double own_atan2(double y, double x) {
    int power, other;
    if (isnan(x) || isnan(y)) {
        return x + y;
    }
    if (y == 0.0 || fabs(y) == HUGE_VAL || fabs(x) == HUGE_VAL) {
        return copysign(marginal_angle(fabs(y), x), y);
    }
    const double b = frexp(fabs(y), &power), a = frexp(x, &other);
    const int difference = power - other;
    if (x != 0.0 && x > 0.0 && difference < -DBL_MANT_DIG) { /* an angle that is its tangent */
        return y / x;
    }
    const int shift = difference > 2 * DBL_MANT_DIG ? 2 * DBL_MANT_DIG : difference;
    const Pair scaled_y = {ldexp(b, shift < -2 * DBL_MANT_DIG ? -2 * DBL_MANT_DIG : shift), 0.0};
    return copysign(angle_of(scaled_y, (Pair){a, 0.0}), y);
}

/* sqrt(1 - x^2) for |x| <= 1. */
static Pair other_side(double x) {
    return pair_root(pair_product(sum_of(1.0, -x), sum_of(1.0, x)));
}

double own_asin(double x) {
    if (!(fabs(x) <= 1.0)) {
        return (double)NAN;
    }
    return fabs(x) < TINY ? x : copysign(angle_of((Pair){fabs(x), 0.0}, other_side(x)), x);
}

double own_acos(double x) {
    return fabs(x) <= 1.0 ? angle_of(other_side(x), (Pair){x, 0.0}) : (double)NAN;
}

double own_hypot(double x, double y) {
    int power;
    const double size = fmax(fabs(x), fabs(y));
    if (fabs(x) == HUGE_VAL || fabs(y) == HUGE_VAL) {
        return HUGE_VAL;
    }
    if (isnan(x) || isnan(y) || size == 0.0) {
        return x + y + size;
    }
    (void)frexp(size, &power);
    const double a = ldexp(x, -power), b = ldexp(y, -power);
    const Pair root = pair_root(pair_sum(product_of(a, a), product_of(b, b)));
    return ldexp(root.high + root.low, power);
}
