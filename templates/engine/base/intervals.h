/* Interval arithmetic: each operation returns an interval that holds every value of the operation on its operands.
   Ends are moved outward by more than the rounding of the operation. An operation that has no value on a part of its
   operands returns what it has on the rest; one that has none anywhere returns the whole line. Source: R. E. Moore, R.
   B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 2 and 5. */
#ifndef INTERVALS_H
#define INTERVALS_H

typedef struct {
    double low, high; /* low <= high; both may be infinite */
} Interval;

/* The interval of one number, which is exact. */
Interval interval_of(double x);

Interval interval_add(Interval a, Interval b);
Interval interval_subtract(Interval a, Interval b);
Interval interval_multiply(Interval a, Interval b);
Interval interval_divide(Interval a, Interval b);
Interval interval_negate(Interval a);
Interval interval_sqrt(Interval a);
Interval interval_exp(Interval a);
Interval interval_log(Interval a);
Interval interval_sin(Interval a);
Interval interval_cos(Interval a);
Interval interval_tan(Interval a);
Interval interval_asin(Interval a);
Interval interval_acos(Interval a);
Interval interval_atan(Interval a);
Interval interval_sinh(Interval a);
Interval interval_cosh(Interval a);
Interval interval_tanh(Interval a);
Interval interval_abs(Interval a);
Interval interval_sign(Interval a);
Interval interval_heaviside(Interval a);
Interval interval_atan2(Interval y, Interval x);
Interval interval_power(Interval a, Interval exponent);

/* A power that is 0 where the base is 0, whatever the exponent. */
Interval interval_power_or_zero(Interval a, Interval exponent);
Interval interval_sloped(Interval slope, Interval rate);

Interval interval_min(Interval a, Interval b);
Interval interval_max(Interval a, Interval b);

/* The least interval that holds both. */
Interval interval_hull(Interval a, Interval b);

/* a where the margin is positive, b where it is not. */
Interval interval_choice(Interval margin, Interval a, Interval b);

#endif
