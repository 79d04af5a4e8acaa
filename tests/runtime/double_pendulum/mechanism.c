/* Double pendulum of point masses: Lagrange's equations with the absolute angles theta1, theta2 as coordinates.

   T = (m1 + m2) l1^2 w1^2 / 2 + m2 l2^2 w2^2 / 2 + m2 l1 l2 cos(theta1 - theta2) w1 w2
   V = -(m1 + m2) g l1 cos theta1 - m2 g l2 cos theta2 */
#include "mechanism.h"

#include <math.h>
#include <stddef.h>

#define ANY -HUGE_VAL, HUGE_VAL
#define NOT_NEGATIVE 0.0, HUGE_VAL

const char MODEL_NAME[] = "double_pendulum";
const char MODEL_GUID[] = "{6c1e5f0a-0d6b-4b0e-8a55-3f1d3b7a9c01}";

const Variable VARIABLES[N_VARIABLES] = {
    {"time", VARIABLE_TIME, 0, ANY, 0},
    {"theta1", VARIABLE_STATE, 0, ANY, 1},
    {"theta2", VARIABLE_STATE, 1, -100.0, 100.0, 1},
    {"theta1_dot", VARIABLE_STATE, 2, ANY, 1},
    {"theta2_dot", VARIABLE_STATE, 3, ANY, 1},
    {"theta1_ddot", VARIABLE_ACCELERATION, 0, ANY, 1},
    {"theta2_ddot", VARIABLE_ACCELERATION, 1, ANY, 0},
    {"Q_theta1", VARIABLE_INPUT, 0, ANY, 0},
    {"Q_theta2", VARIABLE_INPUT, 1, -50.0, 50.0, 0},
    {"m1", VARIABLE_PARAMETER, 0, NOT_NEGATIVE, 0},
    {"m2", VARIABLE_PARAMETER, 1, NOT_NEGATIVE, 0},
    {"l1", VARIABLE_PARAMETER, 2, NOT_NEGATIVE, 0},
    {"l2", VARIABLE_PARAMETER, 3, NOT_NEGATIVE, 0},
    {"g", VARIABLE_PARAMETER, 4, ANY, 0},
    {"solver_tolerance", VARIABLE_SETTING, SETTING_TOLERANCE, NOT_NEGATIVE, 0},
    {"solver_step", VARIABLE_SETTING, SETTING_STEP, NOT_NEGATIVE, 0},
    {"solver_max_step", VARIABLE_SETTING, SETTING_MAX_STEP, NOT_NEGATIVE, 0},
    {"reach", VARIABLE_DEPENDENT, 0, ANY, 0},
    {"kinetic_energy", VARIABLE_LOCAL, 0, ANY, 0},
    {"potential_energy", VARIABLE_LOCAL, 1, ANY, 0},
    {"total_energy", VARIABLE_LOCAL, 2, ANY, 1},
    {"p_theta1", VARIABLE_LOCAL, 3, ANY, 0},
    {"p_theta2", VARIABLE_LOCAL, 4, ANY, 1},
    {"external_power", VARIABLE_LOCAL, 5, ANY, 1},
    {"x_tip_ddot", VARIABLE_LOCAL, 6, ANY, 1},
};

const int CONTINUOUS_STATES[N_CONTINUOUS] = {0, 1, 2, 3};
const double START_STATES[N_STATES] = {1.0, -0.5, 0.0, 0.25};
const double START_INPUTS[N_INPUTS] = {0.0, 0.0};
const double START_PARAMETERS[SIZE_PARAMETERS] = {1.5, 0.75, 1.0, 0.6, 9.81};
const double NOMINAL_STATES[N_STATES] = {1.0, 1.0, 1.0, 1.0};
const char *const COORDINATE_NAMES[N_COORDINATES] = {"theta1", "theta2"};
const char *const CONSTRAINT_NAMES[SIZE_CONSTRAINTS] = {NULL};
const double VIBRATIONS[SIZE_VIBRATIONS] = {0.0};
const char *const EVENT_NAMES[1] = {"none"};
const TableArgument ARGUMENTS[1] = {{"none", 0, 0.0, 0.0}};
const int VIBRATING[SIZE_VIBRATIONS] = {0};
const int MOTION_RATES[SIZE_MOTIONS] = {0};
const int BOUNDED[SIZE_BOUNDED] = {0};
const double RANGES[SIZE_BOUNDED][2] = {{0.0, 0.0}};
const int COLOURS[N_COLOURS][N_COORDINATES] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}};

void mechanism_dependent(const double p[], double c[]) {
    c[0] = p[2] + p[3];
}

void mechanism_dependent_tangent(const double p[], const double dp[], double dc[]) {
    (void)p;
    dc[0] = dp[2] + dp[3];
}

void mechanism_dynamics(double t, const double x[], const double u[], const double p[], double M[], double f[]) {
    const double m = p[0] + p[1], m2 = p[1], l1 = p[2], l2 = p[3], g = p[4];
    const double k = m2 * l1 * l2, c = cos(x[0] - x[1]), s = sin(x[0] - x[1]);
    (void)t;
    M[0] = m * l1 * l1;
    M[2] = k * c;
    M[3] = m2 * l2 * l2;
    f[0] = u[0] - k * s * x[3] * x[3] - m * g * l1 * sin(x[0]);
    f[1] = u[1] + k * s * x[2] * x[2] - m2 * g * l2 * sin(x[1]);
}

/* L D L^T of M: w = (d1, l21, d2). */
void mechanism_factor(double t, const double x[], const double u[], const double p[], double w[], double pivots[]) {
    double M[4], f[2];
    mechanism_dynamics(t, x, u, p, M, f);
    w[0] = M[0];
    w[1] = M[2] / M[0];
    w[2] = M[3] - w[1] * M[2];
    pivots[0] = w[0];
    pivots[1] = w[2];
}

void mechanism_solve(const double w[], const double b[], double a[]) {
    a[1] = (b[1] - w[1] * b[0]) / w[2];
    a[0] = b[0] / w[0] - w[1] * a[1];
}

void mechanism_accelerations(double t, const double x[], const double u[], const double p[], double qdd[],
                             double pivots[]) {
    double w[3], M[4], f[2];
    mechanism_dynamics(t, x, u, p, M, f);
    mechanism_factor(t, x, u, p, w, pivots);
    mechanism_solve(w, f, qdd);
}

void mechanism_residual_tangent(double t, const double x[], const double u[], const double p[], const double qdd[],
                                double dt, const double dx[], const double du[], const double dp[], double dr[]) {
    const double m = p[0] + p[1], m2 = p[1], l1 = p[2], l2 = p[3], g = p[4];
    const double dm = dp[0] + dp[1], dm2 = dp[1], dl1 = dp[2], dl2 = dp[3], dg = dp[4];
    const double k = m2 * l1 * l2, c = cos(x[0] - x[1]), s = sin(x[0] - x[1]);
    const double dk = dm2 * l1 * l2 + m2 * dl1 * l2 + m2 * l1 * dl2;
    const double dkc = dk * c - k * s * (dx[0] - dx[1]), dks = dk * s + k * c * (dx[0] - dx[1]);
    (void)t, (void)u, (void)dt;
    dr[0] = (dm * l1 * l1 + 2.0 * m * l1 * dl1) * qdd[0] + dkc * qdd[1] - du[0] + dks * x[3] * x[3] +
            2.0 * k * s * x[3] * dx[3] + (dm * g * l1 + m * dg * l1 + m * g * dl1) * sin(x[0]) +
            m * g * l1 * cos(x[0]) * dx[0];
    dr[1] = dkc * qdd[0] + (dm2 * l2 * l2 + 2.0 * m2 * l2 * dl2) * qdd[1] - du[1] - dks * x[2] * x[2] -
            2.0 * k * s * x[2] * dx[2] + (dm2 * g * l2 + m2 * dg * l2 + m2 * g * dl2) * sin(x[1]) +
            m2 * g * l2 * cos(x[1]) * dx[1];
}

void mechanism_locals(double t, const double x[], const double u[], const double p[], const double qdd[], double y[]) {
    const double m = p[0] + p[1], m2 = p[1], l1 = p[2], l2 = p[3], g = p[4];
    const double kc = m2 * l1 * l2 * cos(x[0] - x[1]);
    (void)t;
    y[3] = m * l1 * l1 * x[2] + kc * x[3];
    y[4] = m2 * l2 * l2 * x[3] + kc * x[2];
    y[0] = 0.5 * (y[3] * x[2] + y[4] * x[3]);
    y[1] = -m * g * l1 * cos(x[0]) - m2 * g * l2 * cos(x[1]);
    y[2] = y[0] + y[1];
    y[5] = u[0] * x[2] + u[1] * x[3];
    y[6] = l1 * (cos(x[0]) * qdd[0] - sin(x[0]) * x[2] * x[2]) + l2 * (cos(x[1]) * qdd[1] - sin(x[1]) * x[3] * x[3]);
}

void mechanism_locals_tangent(double t, const double x[], const double u[], const double p[], const double qdd[],
                              double dt, const double dx[], const double du[], const double dp[], const double dqdd[],
                              double dy[]) {
    const double m = p[0] + p[1], m2 = p[1], l1 = p[2], l2 = p[3], g = p[4];
    const double dm = dp[0] + dp[1], dm2 = dp[1], dl1 = dp[2], dl2 = dp[3], dg = dp[4];
    const double k = m2 * l1 * l2, c1 = cos(x[0]), s1 = sin(x[0]), c2 = cos(x[1]), s2 = sin(x[1]);
    const double kc = k * cos(x[0] - x[1]);
    const double dk = dm2 * l1 * l2 + m2 * dl1 * l2 + m2 * l1 * dl2;
    const double dkc = dk * cos(x[0] - x[1]) - k * sin(x[0] - x[1]) * (dx[0] - dx[1]);
    const double p1 = m * l1 * l1 * x[2] + kc * x[3], p2 = m2 * l2 * l2 * x[3] + kc * x[2];
    (void)t, (void)dt;
    dy[3] = (dm * l1 * l1 + 2.0 * m * l1 * dl1) * x[2] + m * l1 * l1 * dx[2] + dkc * x[3] + kc * dx[3];
    dy[4] = (dm2 * l2 * l2 + 2.0 * m2 * l2 * dl2) * x[3] + m2 * l2 * l2 * dx[3] + dkc * x[2] + kc * dx[2];
    dy[0] = 0.5 * (dy[3] * x[2] + p1 * dx[2] + dy[4] * x[3] + p2 * dx[3]);
    dy[1] = -(dm * g * l1 + m * dg * l1 + m * g * dl1) * c1 + m * g * l1 * s1 * dx[0] -
            (dm2 * g * l2 + m2 * dg * l2 + m2 * g * dl2) * c2 + m2 * g * l2 * s2 * dx[1];
    dy[2] = dy[0] + dy[1];
    dy[5] = du[0] * x[2] + u[0] * dx[2] + du[1] * x[3] + u[1] * dx[3];
    dy[6] = dl1 * (c1 * qdd[0] - s1 * x[2] * x[2]) + dl2 * (c2 * qdd[1] - s2 * x[3] * x[3]) +
            l1 * (-s1 * dx[0] * qdd[0] + c1 * dqdd[0] - c1 * dx[0] * x[2] * x[2] - 2.0 * s1 * x[2] * dx[2]) +
            l2 * (-s2 * dx[1] * qdd[1] + c2 * dqdd[1] - c2 * dx[1] * x[3] * x[3] - 2.0 * s2 * x[3] * dx[3]);
}

/* A function of time with its first two derivatives: Taylor arithmetic. */
typedef struct {
    double value, first, second;
} Jet;

static Jet plus(Jet a, Jet b) {
    return (Jet){a.value + b.value, a.first + b.first, a.second + b.second};
}

static Jet times(Jet a, Jet b) {
    return (Jet){a.value * b.value, a.first * b.value + a.value * b.first,
                 a.second * b.value + 2.0 * a.first * b.first + a.value * b.second};
}

static Jet scaled(double factor, Jet a) {
    return (Jet){factor * a.value, factor * a.first, factor * a.second};
}

static Jet sine(Jet a) {
    const double s = sin(a.value), c = cos(a.value);
    return (Jet){s, c * a.first, c * a.second - s * a.first * a.first};
}

static Jet cosine(Jet a) {
    const double s = sin(a.value), c = cos(a.value);
    return (Jet){c, -s * a.first, -c * a.first * a.first - s * a.second};
}

void mechanism_residual_second(double t, const double x[], const double u[], const double p[], const double qdd[],
                               const double du[], const double d2u[], const double d3q[], double d2r[]) {
    const double m = p[0] + p[1], m2 = p[1], l1 = p[2], l2 = p[3], g = p[4], k = m2 * l1 * l2;
    const Jet q1 = {x[0], x[2], qdd[0]}, w1 = {x[2], qdd[0], d3q[0]}, a1 = {qdd[0], d3q[0], 0.0};
    const Jet q2 = {x[1], x[3], qdd[1]}, w2 = {x[3], qdd[1], d3q[1]}, a2 = {qdd[1], d3q[1], 0.0};
    const Jet difference = plus(q1, scaled(-1.0, q2));
    const Jet kc = scaled(k, cosine(difference)), ks = scaled(k, sine(difference));
    (void)t, (void)u, (void)du;
    d2r[0] = plus(plus(scaled(m * l1 * l1, a1), times(kc, a2)),
                  plus(times(ks, times(w2, w2)), scaled(m * g * l1, sine(q1)))).second - d2u[0];
    d2r[1] = plus(plus(scaled(m2 * l2 * l2, a2), times(kc, a1)),
                  plus(scaled(-1.0, times(ks, times(w1, w1))), scaled(m2 * g * l2, sine(q2)))).second - d2u[1];
}

/* Of the outputs: total_energy (its first derivative is the power), p_theta2, external_power, x_tip_ddot. */
void mechanism_locals_second(double t, const double x[], const double u[], const double p[], const double qdd[],
                             const double du[], const double d2u[], const double d3q[], const double d4q[],
                             double d2y[]) {
    const double m2 = p[1], l1 = p[2], l2 = p[3];
    const Jet q1 = {x[0], x[2], qdd[0]}, w1 = {x[2], qdd[0], d3q[0]}, a1 = {qdd[0], d3q[0], d4q[0]};
    const Jet q2 = {x[1], x[3], qdd[1]}, w2 = {x[3], qdd[1], d3q[1]}, a2 = {qdd[1], d3q[1], d4q[1]};
    const Jet u1 = {u[0], du[0], d2u[0]}, u2 = {u[1], du[1], d2u[1]};
    const Jet power = plus(times(u1, w1), times(u2, w2));
    const Jet kc = scaled(m2 * l1 * l2, cosine(plus(q1, scaled(-1.0, q2))));
    const Jet x1 = plus(times(cosine(q1), a1), scaled(-1.0, times(sine(q1), times(w1, w1))));
    const Jet x2 = plus(times(cosine(q2), a2), scaled(-1.0, times(sine(q2), times(w2, w2))));
    (void)t;
    d2y[2] = power.first;
    d2y[4] = plus(scaled(m2 * l2 * l2, w2), times(kc, w1)).second;
    d2y[5] = power.second;
    d2y[6] = plus(scaled(l1, x1), scaled(l2, x2)).second;
}
