/* x of M x = b by an LDL^T without pivoting; the upper triangle of M and b are used up. Unrolled for small CASE_N. */
#ifndef SOLVE_H
#define SOLVE_H

#if CASE_N <= 8
#define UNROLLED _Pragma("GCC unroll 8")
#else
#define UNROLLED
#endif

static inline void solve(double M[CASE_N][CASE_N], double b[CASE_N], double x[CASE_N]) {
    double inverse[CASE_N];
    UNROLLED
    for (int k = 0; k < CASE_N; k++) {
        inverse[k] = 1.0 / M[k][k];
        UNROLLED
        for (int i = k + 1; i < CASE_N; i++) {
            const double l = M[k][i] * inverse[k];
            b[i] -= l * b[k];
            UNROLLED
            for (int j = i; j < CASE_N; j++) {
                M[i][j] -= l * M[k][j];
            }
        }
    }
    UNROLLED
    for (int i = CASE_N - 1; i >= 0; i--) {
        x[i] = b[i] * inverse[i];
        UNROLLED
        for (int k = 0; k < i; k++) {
            b[k] -= M[k][i] * x[i];
        }
    }
}

#endif
