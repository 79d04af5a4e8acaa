/* Tables of measured data as piecewise polynomials of one or two arguments. */
#ifndef LOOKUP_H
#define LOOKUP_H

typedef enum { OUTSIDE_HOLD, OUTSIDE_EXTRAPOLATE, OUTSIDE_ERROR } Outside;

/* Between two knots a polynomial of this degree in the distance from the lower one. coefficients[sizes[0] - 1][degree +
   1] of one argument, of two [sizes[0] - 1][sizes[1] - 1][degree + 1][degree + 1], by ascending powers. */
typedef struct {
    int degree;
    Outside outside;
    int sizes[2];
    const double *knots[2]; /* increasing */
    const double *coefficients;
} Table;

/* The derivative of this order at x; NaN outside the knots if that is an error. */
double lookup(const Table *table, int order, double x);

/* The derivative of these orders at x, y of a table of two arguments; NaN outside the knots if that is an error. */
double lookup_2(const Table *table, int order_x, int order_y, double x, double y);

#endif
