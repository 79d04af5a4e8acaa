/* xi'' = xi'^2 + F, see mechanism.h. */
#include "mechanism.h"

#include <math.h>
#include <stddef.h>

const char MODEL_NAME[] = "blow_up";
const char MODEL_GUID[] = "{0f7a2b5e-93a1-4a0f-b3a4-5d2c8e6f1b02}";

const Variable VARIABLES[N_VARIABLES] = {
    {"time", VARIABLE_TIME, 0, -HUGE_VAL, HUGE_VAL, 0},
    {"xi", VARIABLE_STATE, 0, -HUGE_VAL, HUGE_VAL, 1},
    {"xi_dot", VARIABLE_STATE, 1, -HUGE_VAL, HUGE_VAL, 1},
    {"xi_ddot", VARIABLE_ACCELERATION, 0, -HUGE_VAL, HUGE_VAL, 1},
    {"F", VARIABLE_INPUT, 0, -HUGE_VAL, HUGE_VAL, 0},
    {"solver_tolerance", VARIABLE_SETTING, SETTING_TOLERANCE, 0.0, HUGE_VAL, 0},
    {"solver_step", VARIABLE_SETTING, SETTING_STEP, 0.0, HUGE_VAL, 0},
    {"solver_max_step", VARIABLE_SETTING, SETTING_MAX_STEP, 0.0, HUGE_VAL, 0},
};

const int CONTINUOUS_STATES[N_CONTINUOUS] = {0, 1};
const double START_STATES[N_STATES] = {0.0, 1.0};
const double START_INPUTS[N_INPUTS] = {0.0};
const double START_PARAMETERS[SIZE_PARAMETERS] = {0.0};
const double NOMINAL_STATES[N_STATES] = {1.0, 1.0};
const char *const COORDINATE_NAMES[N_COORDINATES] = {"xi"};
const char *const CONSTRAINT_NAMES[SIZE_CONSTRAINTS] = {NULL};
const double VIBRATIONS[SIZE_VIBRATIONS] = {0.0};
const char *const EVENT_NAMES[1] = {"none"};
const TableArgument ARGUMENTS[1] = {{"none", 0, 0.0, 0.0}};
const int VIBRATING[SIZE_VIBRATIONS] = {0};
const int MOTION_RATES[SIZE_MOTIONS] = {0};
const int BOUNDED[SIZE_BOUNDED] = {0};
const double RANGES[SIZE_BOUNDED][2] = {{0.0, 0.0}};
const int COLOURS[N_COLOURS][N_COORDINATES] = {{1}}; /* the acceleration depends on the velocity only */

void mechanism_dependent(const double p[], double c[]) {
    (void)p, (void)c;
}

void mechanism_dependent_tangent(const double p[], const double dp[], double dc[]) {
    (void)p, (void)dp, (void)dc;
}

void mechanism_dynamics(double t, const double x[], const double u[], const double p[], double M[], double f[]) {
    (void)t, (void)p;
    M[0] = x[0] > 5.0 && x[0] < 8.0 ? 0.0 : 1.0;
    f[0] = x[1] * x[1] + u[0];
}

void mechanism_factor(double t, const double x[], const double u[], const double p[], double w[], double pivots[]) {
    double f[1];
    mechanism_dynamics(t, x, u, p, pivots, f);
    w[0] = pivots[0];
}

void mechanism_solve(const double w[], const double b[], double a[]) {
    a[0] = b[0] / w[0];
}

void mechanism_accelerations(double t, const double x[], const double u[], const double p[], double qdd[],
                             double pivots[]) {
    double f[1];
    mechanism_dynamics(t, x, u, p, pivots, f);
    qdd[0] = f[0] / pivots[0];
}

void mechanism_residual_tangent(double t, const double x[], const double u[], const double p[], const double qdd[],
                                double dt, const double dx[], const double du[], const double dp[], double dr[]) {
    (void)t, (void)u, (void)p, (void)qdd, (void)dt, (void)dp;
    dr[0] = -2.0 * x[1] * dx[1] - du[0];
}

void mechanism_locals(double t, const double x[], const double u[], const double p[], const double qdd[], double y[]) {
    (void)t, (void)x, (void)u, (void)p, (void)qdd, (void)y;
}

void mechanism_locals_tangent(double t, const double x[], const double u[], const double p[], const double qdd[],
                              double dt, const double dx[], const double du[], const double dp[], const double dqdd[],
                              double dy[]) {
    (void)t, (void)x, (void)u, (void)p, (void)qdd, (void)dt, (void)dx, (void)du, (void)dp, (void)dqdd, (void)dy;
}

void mechanism_residual_second(double t, const double x[], const double u[], const double p[], const double qdd[],
                               const double du[], const double d2u[], const double d3q[], double d2r[]) {
    (void)t, (void)u, (void)p, (void)du;
    d2r[0] = -2.0 * (qdd[0] * qdd[0] + x[1] * d3q[0]) - d2u[0];
}

void mechanism_locals_second(double t, const double x[], const double u[], const double p[], const double qdd[],
                             const double du[], const double d2u[], const double d3q[], const double d4q[],
                             double d2y[]) {
    (void)t, (void)x, (void)u, (void)p, (void)qdd, (void)du, (void)d2u, (void)d3q, (void)d4q, (void)d2y;
}
