/* The classical method of order 4, fixed step; Kutta 1901. */
#include <stddef.h>

#include "runge_kutta.h"
#include "solver.h"

static const double A[16] = {
    0, 0, 0, 0,
    0.5, 0, 0, 0,
    0, 0.5, 0, 0,
    0, 0, 1, 0,
};
static const double B[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
static const double C[4] = {0, 0.5, 0.5, 1};

const Method METHOD = {"runge_kutta_4", 4, 0, 0};
const Tableau TABLEAU = {4, 4, 0, A, B, C, NULL, NULL, NULL, 2.7852935630083087};
