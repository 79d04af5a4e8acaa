/* The equations of motion M(t, q, p) qdd = f(t, q, qd, u, p), evaluated and solved.

   Functions that return bool return false when there is no finite result; instance->failure then tells why. */
#ifndef EQUATIONS_H
#define EQUATIONS_H

#include "instance.h"

/* A direction in the space of the knowns: of time, states, inputs and parameters. */
typedef struct {
    double time;
    double states[N_STATES];
    double inputs[N_SIGNALS];
    double parameters[SIZE_PARAMETERS];
} Seed;

/* The derivatives along a Seed. */
typedef struct {
    double accelerations[N_UNKNOWNS]; /* and of the multipliers behind them */
    double dependent[SIZE_DEPENDENT];
    double locals[SIZE_LOCALS];
} Tangent;

/* The motion at the present point: q and its time derivatives, (order of derivative, coordinate), and the first and
   second time derivatives of the locals (the second ones of outputs only). */
typedef struct {
    double q[3 + MAX_OUTPUT_ORDER][N_UNKNOWNS]; /* from the second order on the multipliers stand behind */
    double locals[MAX_OUTPUT_ORDER][SIZE_LOCALS];
} Motion;

/* derivatives[2n] = [qd, qdd] at any time (s) and states[2n] in a communication step, with the inputs at that time; not
   to be used where that fails. Touches no cache: the solver does not depend on which variables were read in between. */
bool equations_derivative(Instance *instance, double time, const double states[], double derivatives[]);

/* d(qdd)/d(q, qd) likewise: jacobian[2n][n], a row for each state, by tangents along groups of states that do not meet
   (Curtis, Powell, Reid, On the estimation of sparse Jacobian matrices, 1974). For implicit solvers only. */
bool equations_jacobian(Instance *instance, double time, const double states[], double jacobian[]);

/* In initialization mode: solves for the start values that constraints determine; nothing else ever. All that reads
   states then calls this first. */
bool equations_settle(Instance *instance);

/* These bring one part of the cache up to date with the State. */
void equations_dependent(Instance *instance);
bool equations_massless(Instance *instance); /* what follows from the states; in co-simulation steps have seen to it */
bool equations_accelerations(Instance *instance);
bool equations_locals(Instance *instance);

/* Completes the seed by how what has no mass answers to it, in initialization mode all start values that constraints
   determine. */
bool equations_settle_seed(Instance *instance, Seed *seed);

/* The tangent of the dependent parameters, and of accelerations and locals, at the present point along the seed. */
void equations_dependent_tangent(const Instance *instance, const Seed *seed, Tangent *tangent);
bool equations_tangent(Instance *instance, const Seed *seed, Tangent *tangent);

/* In model exchange, at the end of a step: keeps the accelerations for singular positions, unless it is at one. */
void equations_remember(Instance *instance);

/* The motion with derivatives of q up to 2 + order and of the locals up to order, -1 to 2, the inputs moving
   with their present derivatives. */
bool equations_motion(Instance *instance, int order, Motion *motion);

#endif
