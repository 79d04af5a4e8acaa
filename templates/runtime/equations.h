/* The equations of motion M(t, q, p) qdd = f(t, q, qd, u, p), evaluated and solved.

   Functions that return bool return false when there is no finite result; instance->failure then tells why. */
#ifndef EQUATIONS_H
#define EQUATIONS_H

#include "instance.h"

/* A direction in the space of the knowns: of time, states, inputs and parameters. */
typedef struct {
    double time;
    double states[N_STATES];
    double inputs[N_INPUTS];
    double parameters[SIZE_PARAMETERS];
} Seed;

/* The derivatives along a Seed. */
typedef struct {
    double accelerations[N_COORDINATES];
    double dependent[SIZE_DEPENDENT];
    double locals[SIZE_LOCALS];
} Tangent;

/* dx/dt = [qd, qdd] at any time and states, with the present inputs and parameters. Touches no cache: the solver
   does not depend on which variables were read in between. */
bool equations_derivative(Instance *instance, double time, const double states[], double derivatives[]);

/* These bring one part of the cache up to date with the State. */
void equations_dependent(Instance *instance);
bool equations_accelerations(Instance *instance);
bool equations_locals(Instance *instance);

/* The tangent of the dependent parameters, and of accelerations and locals, at the present point along the seed. */
void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent);
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent);

#endif
