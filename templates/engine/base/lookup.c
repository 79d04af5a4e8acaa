/* The interval by bisection, the polynomial by Horner's rule. */
#include "lookup.h"

#include <math.h>
#include <stdbool.h>

/* Where an argument is: the interval, and how far above its lower knot. */
typedef struct {
    int interval;
    double distance;
    bool flat; /* outside, where the value is held: derivatives are 0 */
    bool lost; /* there is no value */
} Place;

static Place locate(const Table *table, int axis, double x) {
    const double *knots = table->knots[axis];
    int low = 0, high = table->sizes[axis] - 1;
    const bool below = x < knots[0], above = x > knots[high];
    const bool held = table->outside == OUTSIDE_HOLD && (below || above);
    const double at = !held ? x : below ? knots[0] : knots[high];
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (at < knots[middle]) {
            high = middle;
        } else {
            low = middle;
        }
    }
    return (Place){low, at - knots[low], held, !(x == x) || (table->outside == OUTSIDE_ERROR && (below || above))};
}

/* The derivative of this order of the polynomial with these coefficients at s. */
static double polynomial(const double coefficients[], int degree, int order, double s) {
    double value = 0.0;
    for (int k = degree; k >= order; k--) {
        double factor = 1.0;
        for (int i = 0; i < order; i++) {
            factor *= (double)(k - i);
        }
        value = value * s + factor * coefficients[k];
    }
    return value;
}

double lookup(const Table *table, int order, double x) {
    const Place place = locate(table, 0, x);
    if (place.lost || (place.flat && order > 0)) {
        return place.lost ? NAN : 0.0;
    }
    return polynomial(table->coefficients + place.interval * (table->degree + 1), table->degree, order,
                      place.distance);
}

double lookup_2(const Table *table, int order_x, int order_y, double x, double y) {
    const Place first = locate(table, 0, x), second = locate(table, 1, y);
    const int terms = table->degree + 1;
    const double *cell =
        table->coefficients + (first.interval * (table->sizes[1] - 1) + second.interval) * terms * terms;
    double values[4];
    if (first.lost || second.lost) {
        return NAN;
    }
    if ((first.flat && order_x > 0) || (second.flat && order_y > 0)) {
        return 0.0;
    }
    for (int k = 0; k < terms; k++) {
        values[k] = polynomial(cell + k * terms, table->degree, order_y, second.distance);
    }
    return polynomial(values, table->degree, order_x, first.distance);
}
