/* What every kernel implements. A row `in` is x = (q, qd), Q, p, qdd, dx, dQ, dp.
   The compiler is given CASE_N, the number n of coordinates, and CASE_P, that of parameters. */
#ifndef CALL_H
#define CALL_H

#ifdef __cplusplus
extern "C"
#endif
void call(const double in[], double out[]);

#define IN_X (in)
#define IN_QD (in + CASE_N)
#define IN_FORCES (in + 2 * CASE_N)
#define IN_P (in + 3 * CASE_N)
#define IN_QDD (in + 3 * CASE_N + CASE_P)
#define IN_DX (in + 4 * CASE_N + CASE_P)
#define IN_DFORCES (in + 6 * CASE_N + CASE_P)
#define IN_DP (in + 7 * CASE_N + CASE_P)

#endif
