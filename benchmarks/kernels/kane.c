/* M and f of SymPy's or pydy's Kane equations, then LDL^T. */
#include <math.h>

#include "call.h"
#include "generated.h"
#include "solve.h"

void call(const double in[], double out[]) {
    double M[CASE_N][CASE_N], b[CASE_N];
    mass_and_forcing(IN_X, IN_QD, IN_P, &M[0][0], b);
    for (int i = 0; i < CASE_N; i++) {
        b[i] += IN_FORCES[i];
    }
    solve(M, b, out);
}
