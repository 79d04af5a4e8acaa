/* The terms of the Lagrange equations at one state, by polarisation and complex steps as in equations.py.

   The generated file, included below, defines the sizes N (coordinates), MOTIONS, M (constraints), RATES, EFFORTS, whose
   velocities meet in a term of K (MEETS), and the functions of a mechanism: energies, forces, constraints, and of loads
   and dampers on frames rates, efforts and power. A complex number x + i h stands for a value and its derivative: h is
   tiny, and every function continues by its first derivative, as in functions.py. */

#include <complex.h>
#include <math.h>
#include <string.h>

typedef double complex Z;

static const double STEP = 7.888609052210118e-31; /* 2^-100 */

static inline Z of(double re, double im) {
    union { double parts[2]; Z z; } both = {{re, im}};
    return both.z;
}
/* f(x) + i f'(x) Im z */
static inline Z lifted(double value, double slope, Z z) {
    return of(value, cimag(z) == 0.0 ? 0.0 : slope * cimag(z));
}
static inline Z z_sin(Z z) { return lifted(sin(creal(z)), cos(creal(z)), z); }
static inline Z z_cos(Z z) { return lifted(cos(creal(z)), -sin(creal(z)), z); }
static inline Z z_tan(Z z) { const double f = tan(creal(z)); return lifted(f, 1.0 + f * f, z); }
static inline Z z_asin(Z z) { const double x = creal(z); return lifted(asin(x), 1.0 / sqrt(1.0 - x * x), z); }
static inline Z z_acos(Z z) { const double x = creal(z); return lifted(acos(x), -1.0 / sqrt(1.0 - x * x), z); }
static inline Z z_atan(Z z) { const double x = creal(z); return lifted(atan(x), 1.0 / (1.0 + x * x), z); }
static inline Z z_sinh(Z z) { return lifted(sinh(creal(z)), cosh(creal(z)), z); }
static inline Z z_cosh(Z z) { return lifted(cosh(creal(z)), sinh(creal(z)), z); }
static inline Z z_tanh(Z z) { const double f = tanh(creal(z)); return lifted(f, 1.0 - f * f, z); }
static inline Z z_exp(Z z) { const double f = exp(creal(z)); return lifted(f, f, z); }
static inline Z z_log(Z z) { return lifted(log(creal(z)), 1.0 / creal(z), z); }
static inline Z z_sqrt(Z z) { const double f = sqrt(creal(z)); return lifted(f, 0.5 / f, z); }
static inline Z z_inverse(Z z) { const double f = 1.0 / creal(z); return lifted(f, -f * f, z); }
static inline double z_sign(Z z) { return (creal(z) > 0.0) - (creal(z) < 0.0); }
static inline Z z_abs(Z z) { return z_sign(z) * z; }
static inline double z_heaviside(Z z) { return creal(z) == 0.0 ? 0.5 : creal(z) > 0.0; }
static inline Z z_min(Z a, Z b) { return creal(a) <= creal(b) ? a : b; }
static inline Z z_max(Z a, Z b) { return creal(a) >= creal(b) ? a : b; }
static inline Z z_choice(Z margin, Z a, Z b) { return creal(margin) > 0.0 ? a : b; }
static inline Z z_atan2(Z y, Z x) {
    const double a = creal(y), b = creal(x);
    return of(atan2(a, b), (b * cimag(y) - a * cimag(x)) / (a * a + b * b));
}
static inline Z z_power(Z base, Z exponent) {
    const double x = creal(base), y = creal(exponent), value = pow(x, y);
    double slope = cimag(base) == 0.0 ? 0.0 : y * pow(x, y - 1.0) * cimag(base);
    if (cimag(exponent) != 0.0) {
        slope += value * log(x) * cimag(exponent);
    }
    return of(value, slope);
}
static inline Z z_integer_power(Z z, int exponent) {
    Z power = 1.0;
    for (int i = 0; i < (exponent < 0 ? -exponent : exponent); i++) {
        power *= z;
    }
    return exponent < 0 ? z_inverse(power) : power;
}

/* ROWS are t, q, qd, y, y_dot; INPUTS are t, q, qd and what comes from outside. */
#define ROWS (1 + 2 * N + 2 * MOTIONS)
#define INPUTS (1 + 2 * N + 3 * MOTIONS + OTHERS)

#include "mechanism.h"

/* What the motion makes of t, q, y, y_dot in a complex step: their rates are 1, qd (0 for the explicit rate), y_dot,
   y_ddot. row: t, q, qd, y, y_dot, y_ddot. */
static void move(Z point[ROWS], const double row[], int explicitly) {
    point[0] += of(0.0, STEP);
    for (int i = 0; i < N && !explicitly; i++) {
        point[1 + i] += of(0.0, STEP * row[1 + N + i]);
    }
    for (int i = 0; i < 2 * MOTIONS; i++) {
        point[1 + 2 * N + i] += of(0.0, STEP * row[1 + 2 * N + MOTIONS + i]);
    }
}

/* K where q moves and the velocities are factor_i unit_i and factor_j unit_j. */
static Z kinetic(const Z moved[ROWS], const double p[], int i, double factor_i, int j, double factor_j) {
    Z point[ROWS], parts[3];
    memcpy(point, moved, sizeof point);
    for (int k = 0; k < N; k++) {
        point[1 + N + k] = 0.0;
    }
    point[1 + N + i] = factor_i;
    if (j >= 0) {
        point[1 + N + j] = factor_j;
    }
    energies(point, p, parts);
    return parts[0];
}

/* M = dp/dqd and b, p = M qd + b, and their rates: see equations.py. unit: velocities of about equal energy. */
static void inertia(const double row[], const double p[], const double unit[N], double matrix[N][N],
                    double momenta[N], double inertial[N]) {
    Z moved[ROWS], plus[N], sums[N];
    for (int i = 0; i < ROWS; i++) {
        moved[i] = row[i];
    }
    move(moved, row, 0);
    const Z zero = kinetic(moved, p, 0, 0.0, -1, 0.0);
    for (int i = 0; i < N; i++) {
        plus[i] = kinetic(moved, p, i, unit[i], -1, 0.0);
        const Z minus = kinetic(moved, p, i, -unit[i], -1, 0.0);
        const Z entry = (plus[i] + minus - 2.0 * zero) / (unit[i] * unit[i]);
        matrix[i][i] = creal(entry);
        sums[i] = entry * row[1 + N + i] + (plus[i] - minus) / (2.0 * unit[i]);
    }
    for (int i = 0; i < N; i++) {
        for (int j = i + 1; j < N; j++) {
            matrix[i][j] = matrix[j][i] = 0.0;
            if (M == 0 && !MEETS[i][j]) { /* elsewhere rounding chooses among the ways of redundant forces */
                continue;
            }
            const Z both = kinetic(moved, p, i, unit[i], j, unit[j]);
            const Z entry = (both - plus[i] - plus[j] + zero) / (unit[i] * unit[j]);
            matrix[i][j] = matrix[j][i] = creal(entry);
            sums[i] += entry * row[1 + N + j];
            sums[j] += entry * row[1 + N + i];
        }
    }
    for (int i = 0; i < N; i++) {
        momenta[i] = creal(sums[i]);
        inertial[i] = cimag(sums[i]) / STEP;
    }
}

/* Adds to Q (N) what loads and dampers with a force do that are on frames: the slopes of their power along qd. The
   efforts themselves are not differentiated. row: t, q, qd, inputs. */
static void add_loads(const double row[], const double p[], double Q[N]) {
    Z inputs[INPUTS + RATES], point[ROWS + EFFORTS], work[1];
    double rate[RATES + 1], effort[EFFORTS + 1];
    for (int i = 0; i < INPUTS; i++) {
        inputs[i] = row[i];
    }
    rates(inputs, p, rate);
    for (int i = 0; i < RATES; i++) {
        inputs[INPUTS + i] = rate[i];
    }
    efforts(inputs, p, effort);
    memcpy(point, inputs, ROWS * sizeof *point);
    for (int i = 0; i < EFFORTS; i++) {
        point[ROWS + i] = effort[i];
    }
    for (int i = 0; i < N; i++) {
        point[1 + N + i] += of(0.0, STEP);
        power(point, p, work);
        Q[i] += cimag(work[0]) / STEP;
        point[1 + N + i] = row[1 + N + i];
    }
}

/* out: M (N N), p, inertial, dL/dq, dR/dqd (N each), dL/dt, Q (N), constraints (3 M + M N). row: t, q, qd, inputs. */
#ifdef _WIN32
__declspec(dllexport)
#endif
void terms(const double row[], const double p[], const double unit[], double *out) {
    double *momenta = out + N * N, *slopes = momenta + 2 * N;
    Z point[ROWS], parts[3], inputs[INPUTS];
    inertia(row, p, unit, (double(*)[N])out, momenta, momenta + N);
    for (int i = 0; i < ROWS; i++) {
        point[i] = row[i];
    }
    for (int i = 0; i < 2 * N; i++) {
        point[1 + i] += of(0.0, STEP);
        energies(point, p, parts);
        slopes[i] = (i < N ? cimag(parts[0]) - cimag(parts[1]) : cimag(parts[2])) / STEP;
        point[1 + i] = row[1 + i];
    }
    move(point, row, 1);
    energies(point, p, parts);
    slopes[2 * N] = (cimag(parts[0]) - cimag(parts[1])) / STEP;
    for (int i = 0; i < INPUTS; i++) {
        inputs[i] = row[i];
    }
    forces(inputs, p, slopes + 2 * N + 1);
    if (EFFORTS > 0) {
        add_loads(row, p, slopes + 2 * N + 1);
    }
    constraints(inputs, p, slopes + 3 * N + 1);
}
