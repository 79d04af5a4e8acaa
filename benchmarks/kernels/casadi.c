/* A function of CasADi that returns the accelerations; with seeds it returns their directional derivative. */
#include "generated.h"

#include "call.h"

void call(const double in[], double out[]) {
    const double *arguments[SZ_ARG] = {IN_X, IN_FORCES, IN_P, IN_DX, IN_DFORCES, IN_DP};
    double *results[SZ_RES] = {out};
    static double work[SZ_W];
    static casadi_int integers[SZ_IW];
    f(arguments, results, integers, work, 0);
}
