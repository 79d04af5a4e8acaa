/* The directional derivative of the accelerations as the FMU evaluates it, qdd being known. */
#include <math.h>

#include "call.h"
#include "generated.h"

void call(const double in[], double out[]) {
    double pivots[CASE_N], change[CASE_N], factor[N_FACTOR];
    mechanism_residual_tangent(0.0, IN_X, IN_FORCES, IN_P, IN_QDD, 0.0, IN_DX, IN_DFORCES, IN_DP, change);
    mechanism_factor(0.0, IN_X, IN_FORCES, IN_P, factor, pivots);
    mechanism_solve(factor, change, out);
    for (int i = 0; i < CASE_N; i++) {
        out[i] = -out[i];
    }
}
