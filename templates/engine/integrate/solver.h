/* What a solver is: the functions below, and a header solver_memory.h that says what it carries along. Each family of
   methods has a folder, and the one that was chosen at export is compiled. */
#ifndef SOLVER_H
#define SOLVER_H

#include "instance.h"

typedef struct {
    const char *name;
    int order;       /* of the new states */
    int error_order; /* the error estimate of a step is proportional to its length to this power plus 1; 0: there is
                        none, and steps have a fixed length */
    int dense_order; /* of the states within a step, 0 if it gives none */
    double safety;   /* the part that is taken of the step which would just meet the tolerance */
    double stability; /* steps h for dx/dt = -x do not grow up to this h; 0: no h is too long, or it is not known */
    bool variational; /* the method works on momenta: it meets the constraints by itself, knows forces of inertia by
                         momenta alone, and keeps the energy bounded as long as its steps are equal */
    bool damps;       /* vibrations that the steps do not resolve are damped; by other methods they are missed */
} Method;

extern const Method METHOD;

/* One trial step from the present point. Calls hand on two numbers in registers, and a larger record in memory. */
typedef struct {
    double length; /* s */
    double end;    /* the time where it ends, s */
} Step;

/* One trial step from the present point and its state->first_stage. Fills scratch new_states and new_derivatives, which
   are not at the end where it sets derivatives_late. The
   State is not changed, but for what an implicit method remembers so as to iterate less. Returns false, with
   instance->failure set, if one of them is not finite. */
bool solver_step(Instance *instance, Step step);

/* The error estimate of the last trial step, the maximum over the states of |error_i| / weight_i with
   weight_i = tolerance * (max(|x_i|, |x_new_i|) + nominal_i); worst is the index of that state. */
double solver_error(const Instance *instance, Step step, double tolerance, int *worst);

/* The length of the last trial step in units of what the stability of the method allows for the fastest decay in the
   motion; 0 if that is not known or not limited. Of a linearly implicit method more than 1 where its linearization does
   not hold over the step. Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2. */
double solver_stiffness(const Instance *instance);

/* The terms of the interpolant (dense_output.h) from HERMITE_TERMS on, for the last trial step, which is about to be
   accepted. Returns false, with instance->failure set, if an evaluation for them fails. */
bool solver_dense(Instance *instance, Step step, double terms[DENSE_TERMS][N_STATES]);

#endif
