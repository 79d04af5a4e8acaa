/* The directional derivative along a further seed: the factorisation is that of the first (here: of the first row).
   For timing only; the values are those of another state. */
#include <math.h>

#include "call.h"
#include "generated.h"

void call(const double in[], double out[]) {
    static double factor[N_FACTOR];
    static int known = 0;
    double pivots[CASE_N], change[CASE_N];
    if (!known) {
        mechanism_factor(0.0, IN_X, IN_FORCES, IN_P, factor, pivots);
        known = 1;
    }
    mechanism_residual_tangent(0.0, IN_X, IN_FORCES, IN_P, IN_QDD, 0.0, IN_DX, IN_DFORCES, IN_DP, change);
    mechanism_solve(factor, change, out);
    for (int i = 0; i < CASE_N; i++) {
        out[i] = -out[i];
    }
}
