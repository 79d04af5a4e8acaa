/* A function of CasADi that returns M (column-major, upper triangle) and h, then LDL^T. */
#include "generated.h"

#include "call.h"
#include "solve.h"

void call(const double in[], double out[]) {
    double h[CASE_N], columns[CASE_N * CASE_N], M[CASE_N][CASE_N];
    const double *arguments[SZ_ARG] = {IN_X, IN_FORCES, IN_P};
    double *results[SZ_RES] = {columns, h};
    static double work[SZ_W];
    static casadi_int integers[SZ_IW];
    f(arguments, results, integers, work, 0);
    for (int i = 0; i < CASE_N; i++) {
        h[i] = IN_FORCES[i] - h[i];
        for (int j = i; j < CASE_N; j++) {
            M[i][j] = columns[j * CASE_N + i];
        }
    }
    solve(M, h, out);
}
