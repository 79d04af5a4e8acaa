/* The smallest mechanism, and one that ends: xi'' = xi'^2 + F, no parameters, no locals. With F = 0 the velocity is
   v0 / (1 - v0 t), so that nothing can be computed from t = 1 / v0 on. There is no mass between xi = 5 m and 8 m. */
#ifndef MECHANISM_H
#define MECHANISM_H

#include "variables.h"

#define N_COORDINATES 1
#define N_STATES (2 * N_COORDINATES)
#define N_RESTING 0
#define N_CONSTRAINTS 0
#define SIZE_CONSTRAINTS 1
#define N_HOLONOMIC 0
#define N_CONTINUOUS N_STATES
#define N_MASSLESS 0
#define SIZE_MASSLESS 1
#define N_MASSLESS_POSITIONS 0
#define N_INPUTS 1
#define N_SIGNALS N_INPUTS
#define N_MOTIONS 0
#define N_BOUNDED 0
#define SIZE_BOUNDED 1
#define SIZE_MOTIONS 1
#define N_PARAMETERS 0
#define SIZE_PARAMETERS 1
#define N_DEPENDENT 0
#define SIZE_DEPENDENT 1
#define N_LOCALS 0
#define SIZE_LOCALS 1
#define N_FACTOR 1
#define SIZE_FACTOR 1
#define N_VARIABLES 8
#define DEFAULT_SOLVER_STEP 1e-3
#define REAL_TIME 0
#define MOST_SOLVER_STEPS 1e12
#define DEFAULT_DURATION 10.0
#define TIME_DEPENDENT 0
#define N_COLOURS 1
#define N_VIBRATIONS 0
#define N_ARGUMENTS 0
#define SIZE_VIBRATIONS 1

extern const char MODEL_NAME[], MODEL_GUID[];
extern const Variable VARIABLES[N_VARIABLES];
extern const int CONTINUOUS_STATES[N_CONTINUOUS];
extern const double START_STATES[N_STATES];
extern const double START_INPUTS[N_INPUTS];
extern const double START_PARAMETERS[SIZE_PARAMETERS];
extern const double NOMINAL_STATES[N_STATES];
extern const char *const COORDINATE_NAMES[N_COORDINATES];
extern const char *const CONSTRAINT_NAMES[SIZE_CONSTRAINTS];
extern const double VIBRATIONS[SIZE_VIBRATIONS];
extern const char *const EVENT_NAMES[1];
typedef struct {
    const char *table;
    int position;
    double least, greatest;
} TableArgument;
extern const TableArgument ARGUMENTS[1];
extern const int VIBRATING[SIZE_VIBRATIONS];
extern const int MOTION_RATES[SIZE_MOTIONS];
extern const int BOUNDED[SIZE_BOUNDED];
extern const double RANGES[SIZE_BOUNDED][2];
extern const int COLOURS[N_COLOURS][N_COORDINATES];

void mechanism_dependent(const double p[], double c[]);
void mechanism_accelerations(double t, const double x[], const double u[], const double p[], double qdd[],
                             double pivots[]);
void mechanism_factor(double t, const double x[], const double u[], const double p[], double w[], double pivots[]);
void mechanism_solve(const double w[], const double b[], double a[]);
void mechanism_dynamics(double t, const double x[], const double u[], const double p[], double M[], double f[]);
void mechanism_locals(double t, const double x[], const double u[], const double p[], const double qdd[], double y[]);
void mechanism_residual_tangent(double t, const double x[], const double u[], const double p[], const double qdd[],
                                double dt, const double dx[], const double du[], const double dp[], double dr[]);
void mechanism_locals_tangent(double t, const double x[], const double u[], const double p[], const double qdd[],
                              double dt, const double dx[], const double du[], const double dp[], const double dqdd[],
                              double dy[]);
void mechanism_dependent_tangent(const double p[], const double dp[], double dc[]);
void mechanism_residual_second(double t, const double x[], const double u[], const double p[], const double qdd[],
                               const double du[], const double d2u[], const double d3q[], double d2r[]);
void mechanism_locals_second(double t, const double x[], const double u[], const double p[], const double qdd[],
                             const double du[], const double d2u[], const double d3q[], const double d4q[],
                             double d2y[]);

#endif
