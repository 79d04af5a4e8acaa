/* Heun's method with Euler's embedded, order 2(1): adaptive, and the last stage is not the next step's first. */
#include <stddef.h>

#include "runge_kutta.h"
#include "solver.h"

static const double A[4] = {
    0, 0,
    1, 0,
};
static const double B[2] = {0.5, 0.5};
static const double C[2] = {0, 1};
static const double E[2] = {-0.5, 0.5};

static const double DENSE[2] = {0, 0}; /* Hermite's cubic is enough */

const Method METHOD = {"heun_euler_2_1", 2, 1, 3};
const Tableau TABLEAU = {2, 2, 0, A, B, C, E, NULL, DENSE, 2.0};
