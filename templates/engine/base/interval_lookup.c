/* The hull of the values in all cells that the arguments meet, each by Horner's rule on intervals. */
#include "interval_lookup.h"

#include <math.h>
#include <stdbool.h>

/* The cells that an argument meets. */
typedef struct {
    int first, last;
    bool below, above; /* the argument goes beyond the knots */
} Cells;

static Cells cells_of(const Table *table, int axis, Interval x) {
    const double *knots = table->knots[axis];
    const int last = table->sizes[axis] - 1;
    Cells cells = {0, last - 1, x.low < knots[0], x.high > knots[last]};
    while (cells.first < last - 1 && x.low > knots[cells.first + 1]) {
        cells.first++;
    }
    while (cells.last > 0 && x.high < knots[cells.last]) {
        cells.last--;
    }
    return cells;
}

/* The argument in a cell, less the lower knot of the cell. */
static Interval distance(const Table *table, int axis, int cell, Interval x) {
    const double *knots = table->knots[axis];
    const bool goes_on = table->outside == OUTSIDE_EXTRAPOLATE;
    const double least = cell == 0 && goes_on ? -HUGE_VAL : knots[cell];
    const double greatest = cell == table->sizes[axis] - 2 && goes_on ? HUGE_VAL : knots[cell + 1];
    const Interval part = {fmin(fmax(x.low, least), greatest), fmax(fmin(x.high, greatest), least)};
    return interval_subtract(part, interval_of(knots[cell]));
}

/* The derivative of this order of the polynomial with these coefficients. */
static Interval interval_polynomial(const Interval coefficients[], int degree, int order, Interval s) {
    Interval value = interval_of(0.0);
    for (int k = degree; k >= order; k--) {
        double factor = 1.0;
        for (int i = 0; i < order; i++) {
            factor *= (double)(k - i);
        }
        value = interval_add(interval_multiply(value, s), interval_multiply(interval_of(factor), coefficients[k]));
    }
    return value;
}

static Interval numbers_polynomial(const double numbers[], int degree, int order, Interval s) {
    Interval coefficients[4];
    for (int k = 0; k <= degree; k++) {
        coefficients[k] = interval_of(numbers[k]);
    }
    return interval_polynomial(coefficients, degree, order, s);
}

/* Beyond the knots a value that is held has no slope. */
static bool is_flat(const Table *table, Cells cells, int order) {
    return table->outside == OUTSIDE_HOLD && order > 0 && (cells.below || cells.above);
}

Interval interval_lookup(const Table *table, int order, Interval x) {
    const Cells cells = cells_of(table, 0, x);
    const bool flat = is_flat(table, cells, order);
    Interval found = {flat ? 0.0 : HUGE_VAL, flat ? 0.0 : -HUGE_VAL};
    for (int i = cells.first; i <= cells.last; i++) {
        const double *numbers = table->coefficients + i * (table->degree + 1);
        found = interval_hull(found, numbers_polynomial(numbers, table->degree, order, distance(table, 0, i, x)));
    }
    return found;
}

Interval interval_lookup_2(const Table *table, int order_x, int order_y, Interval x, Interval y) {
    const Cells first = cells_of(table, 0, x), second = cells_of(table, 1, y);
    const bool flat = is_flat(table, first, order_x) || is_flat(table, second, order_y);
    const int terms = table->degree + 1;
    Interval found = {flat ? 0.0 : HUGE_VAL, flat ? 0.0 : -HUGE_VAL};
    for (int i = first.first; i <= first.last; i++) {
        for (int j = second.first; j <= second.last; j++) {
            const double *cell = table->coefficients + (i * (table->sizes[1] - 1) + j) * terms * terms;
            Interval values[4];
            for (int k = 0; k < terms; k++) {
                values[k] = numbers_polynomial(cell + k * terms, table->degree, order_y, distance(table, 1, j, y));
            }
            found = interval_hull(found, interval_polynomial(values, table->degree, order_x, distance(table, 0, i, x)));
        }
    }
    return found;
}
