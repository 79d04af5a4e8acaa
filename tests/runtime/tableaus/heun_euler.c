/* Heun's method with Euler's embedded, order 2(1): adaptive, and the last stage is not the next step's first. */
#include <stddef.h>

#include "runge_kutta.h"

static const double A[4] = {
    0, 0,
    1, 0,
};
static const double B[2] = {0.5, 0.5};
static const double C[2] = {0, 1};
static const double E[2] = {-0.5, 0.5};

const Tableau TABLEAU = {"heun_euler_2_1", 2, 2, 1, 0, A, B, C, E};
