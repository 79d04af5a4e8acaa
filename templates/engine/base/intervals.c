/* Ends are computed in the present rounding mode and moved outward by SPREAD of themselves, which is more than the
   error of the operations of IEEE 754 (half a unit) and of the C library's functions (a few units). */
#include "intervals.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

static const double SPREAD = 8.0 * DBL_EPSILON;
static const double PI = 3.14159265358979323846;

/* Between these ends, which are NaN where nothing is known, as of infinity minus infinity. */
static Interval between(double low, double high) {
    const double below = low - SPREAD * fabs(low) - DBL_MIN, above = high + SPREAD * fabs(high) + DBL_MIN;
    return (Interval){isnan(below) ? -HUGE_VAL : below, isnan(above) ? HUGE_VAL : above};
}

static Interval whole(void) {
    return (Interval){-HUGE_VAL, HUGE_VAL};
}

/* `a` without what is outside of these bounds; the whole line if nothing is left. */
static Interval inside(Interval a, double low, double high) {
    const Interval kept = {fmax(a.low, low), fmin(a.high, high)};
    return kept.low <= kept.high ? kept : whole();
}

/* Around four values; 0 times infinity is 0, since the ends of an interval that are infinite do not belong to it. */
static Interval around(const double values[4]) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int i = 0; i < 4; i++) {
        const double value = isnan(values[i]) ? 0.0 : values[i];
        low = fmin(low, value);
        high = fmax(high, value);
    }
    return between(low, high);
}

Interval interval_of(double x) {
    return isnan(x) ? whole() : (Interval){x, x};
}

Interval interval_add(Interval a, Interval b) {
    return between(a.low + b.low, a.high + b.high);
}

Interval interval_subtract(Interval a, Interval b) {
    return between(a.low - b.high, a.high - b.low);
}

Interval interval_multiply(Interval a, Interval b) {
    return around((const double[]){a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high});
}

Interval interval_divide(Interval a, Interval b) {
    if (b.low <= 0.0 && b.high >= 0.0) {
        return whole();
    }
    return around((const double[]){a.low / b.low, a.low / b.high, a.high / b.low, a.high / b.high});
}

Interval interval_negate(Interval a) {
    return (Interval){-a.high, -a.low};
}

Interval interval_sqrt(Interval a) {
    const Interval kept = inside(a, 0.0, HUGE_VAL);
    return kept.low < 0.0 ? whole() : between(sqrt(kept.low), sqrt(kept.high));
}

Interval interval_exp(Interval a) {
    return between(exp(a.low), exp(a.high));
}

Interval interval_log(Interval a) {
    const Interval kept = inside(a, 0.0, HUGE_VAL);
    return kept.low < 0.0 ? whole() : between(log(kept.low), log(kept.high));
}

/* Is there a whole number n with low <= offset + n period <= high? Rounding answers yes. */
static bool meets_at(Interval a, double offset, double period) {
    const double first = (a.low - offset) / period, last = (a.high - offset) / period;
    const double doubt = SPREAD * fmax(fabs(first), fabs(last)) + SPREAD;
    return !(ceil(first - doubt) > last + doubt);
}

Interval interval_sin(Interval a) {
    const double first = sin(a.low), last = sin(a.high);
    const Interval ends = between(fmin(first, last), fmax(first, last));
    if (!(a.high - a.low < 2.0 * PI)) {
        return (Interval){-1.0, 1.0};
    }
    return (Interval){meets_at(a, -0.5 * PI, 2.0 * PI) ? -1.0 : ends.low,
                      meets_at(a, 0.5 * PI, 2.0 * PI) ? 1.0 : ends.high};
}

Interval interval_cos(Interval a) {
    const double first = cos(a.low), last = cos(a.high);
    const Interval ends = between(fmin(first, last), fmax(first, last));
    if (!(a.high - a.low < 2.0 * PI)) {
        return (Interval){-1.0, 1.0};
    }
    return (Interval){meets_at(a, PI, 2.0 * PI) ? -1.0 : ends.low, meets_at(a, 0.0, 2.0 * PI) ? 1.0 : ends.high};
}

Interval interval_tan(Interval a) {
    return !(a.high - a.low < PI) || meets_at(a, 0.5 * PI, PI) ? whole() : between(tan(a.low), tan(a.high));
}

Interval interval_asin(Interval a) {
    const Interval kept = inside(a, -1.0, 1.0);
    return kept.low < -1.0 ? whole() : between(asin(kept.low), asin(kept.high));
}

Interval interval_acos(Interval a) {
    const Interval kept = inside(a, -1.0, 1.0);
    return kept.low < -1.0 ? whole() : between(acos(kept.high), acos(kept.low));
}

Interval interval_atan(Interval a) {
    return between(atan(a.low), atan(a.high));
}

Interval interval_sinh(Interval a) {
    return between(sinh(a.low), sinh(a.high));
}

Interval interval_cosh(Interval a) {
    const double first = cosh(a.low), last = cosh(a.high);
    return between(a.low <= 0.0 && a.high >= 0.0 ? 1.0 : fmin(first, last), fmax(first, last));
}

Interval interval_tanh(Interval a) {
    return between(tanh(a.low), tanh(a.high));
}

Interval interval_abs(Interval a) {
    const double least = a.low <= 0.0 && a.high >= 0.0 ? 0.0 : fmin(fabs(a.low), fabs(a.high));
    return (Interval){least, fmax(fabs(a.low), fabs(a.high))};
}

static double sign_of(double x) {
    return (double)((x > 0.0) - (x < 0.0));
}

Interval interval_sign(Interval a) {
    return (Interval){sign_of(a.low), sign_of(a.high)};
}

Interval interval_heaviside(Interval a) {
    return (Interval){0.5 * (1.0 + sign_of(a.low)), 0.5 * (1.0 + sign_of(a.high))};
}

/* The angle grows or falls steadily along each side of a box without the origin, unless it jumps from pi to -pi. */
Interval interval_atan2(Interval y, Interval x) {
    if (x.low <= 0.0 && y.low <= 0.0 && y.high >= 0.0) {
        return between(-PI, PI);
    }
    return around((const double[]){atan2(y.low, x.low), atan2(y.low, x.high), atan2(y.high, x.low),
                                   atan2(y.high, x.high)});
}

/* A power of a positive base is monotone in the base and in the exponent. A whole power of an interval that holds 0 is
   least or greatest there; other powers have no value below 0. */
Interval interval_power(Interval a, Interval exponent) {
    const double n = exponent.low;
    const bool is_whole = exponent.low == exponent.high && n == floor(n);
    const bool even = is_whole && fmod(n, 2.0) == 0.0, holds_zero = a.low <= 0.0 && a.high >= 0.0;
    const Interval base = is_whole ? a : inside(a, 0.0, HUGE_VAL);
    if ((!is_whole && base.low < 0.0) || (is_whole && n < 0.0 && holds_zero && !even)) {
        return whole();
    }
    const double corners[4] = {pow(base.low, exponent.low), pow(base.low, exponent.high),
                               pow(base.high, exponent.low), pow(base.high, exponent.high)};
    const Interval found = around(corners);
    if (even && holds_zero && n != 0.0) {
        return n > 0.0 ? (Interval){0.0, found.high} : (Interval){found.low, HUGE_VAL};
    }
    return found;
}

Interval interval_power_or_zero(Interval a, Interval exponent) {
    const Interval found = interval_power(a, exponent);
    return a.low <= 0.0 && a.high >= 0.0 ? interval_hull(found, interval_of(0.0)) : found;
}

Interval interval_sloped(Interval slope, Interval rate) {
    return rate.low == 0.0 && rate.high == 0.0 ? rate : interval_multiply(slope, rate);
}

Interval interval_min(Interval a, Interval b) {
    return (Interval){fmin(a.low, b.low), fmin(a.high, b.high)};
}

Interval interval_max(Interval a, Interval b) {
    return (Interval){fmax(a.low, b.low), fmax(a.high, b.high)};
}

Interval interval_hull(Interval a, Interval b) {
    return (Interval){fmin(a.low, b.low), fmax(a.high, b.high)};
}

Interval interval_choice(Interval margin, Interval a, Interval b) {
    return margin.low > 0.0 ? a : margin.high <= 0.0 ? b : interval_hull(a, b);
}
