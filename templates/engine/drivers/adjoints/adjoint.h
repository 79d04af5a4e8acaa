/* Adjoint derivatives: the derivatives of a weighted sum of unknowns by all knowns at once, sensitivity = J^T weights,
   where equations_settle_seed and equations_tangent (equations.h) give J seed. Only sources whose program has adjoint
   functions contain this folder.

       Tangent weights = {0};
       Seed sensitivity = {0};
       for each unknown:   *adjoint_weight(&weights, &sensitivity, variable) += its weight;
       equations_adjoint(instance, &weights, &sensitivity);
       for each known:     *value_in_seed(&sensitivity, variable) is the result

   Griewank, Walther, Evaluating Derivatives, SIAM 2008, sections 3.2 (adjoints) and 15.3 (implicit functions). */
#ifndef ADJOINT_H
#define ADJOINT_H

#include "instance.h"

/* The place of the weight of an unknown (value_is_unknown); the weight of a state is in the sensitivity. NULL if the
   variable depends on no known, so that its weight has no effect. */
double *adjoint_weight(Tangent *weights, Seed *sensitivity, const Variable *variable);

/* Sets the derivatives at the present point. In the phase of solving the start they include how the start values that
   are solved for answer. On entry the sensitivity has the weights of states and 0 elsewhere; on return it has the
   derivatives by all knowns. Evaluates no more than the weights that are not 0 need. Returns false, with
   instance->failure, where equations_settle or equations_tangent would. */
bool equations_adjoint(Instance *instance, const Tangent *weights, Seed *sensitivity);

/* Its parts, which add to the sensitivity as if the states were given: those of accelerations, multipliers, rates of
   further states and locals, and those of what depends on parameters alone. */
bool motion_adjoint(Instance *instance, const Tangent *weights, Seed *sensitivity);
void dependent_adjoint(const Instance *instance, const Tangent *weights, Seed *sensitivity);

#endif
