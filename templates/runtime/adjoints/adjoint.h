/* Adjoint derivatives: of the weighted sum of any unknowns its derivatives by all knowns at once, sensitivity = J^T
   weights, where equations_settle_seed and equations_tangent (equations.h) give J seed. Only sources whose program has
   adjoint functions contain this folder.

       Tangent weights = {0};
       Seed sensitivity = {0};
       for each unknown:   *adjoint_weight(&weights, &sensitivity, variable) += its weight;
       equations_adjoint(instance, &weights, &sensitivity);
       for each known:     *value_in_seed(&sensitivity, variable) is the result

   Griewank, Walther, Evaluating Derivatives, SIAM 2008, sections 3.2 (adjoints) and 15.3 (implicit functions). */
#ifndef ADJOINT_H
#define ADJOINT_H

#include "instance.h"

/* Where the weight of an unknown (value_is_unknown) is: that of a state is in the sensitivity. NULL if the variable
   depends on no known, so that any weight of it makes nothing. */
double *adjoint_weight(Tangent *weights, Seed *sensitivity, const Variable *variable);

/* The derivatives at the present point, in the phase of solving the start those of what is solved for included. On
   entry the sensitivity has the weights of states and 0 elsewhere; on return the derivatives by all knowns. Evaluates
   no more than the weights that are not 0 need. Returns false, with instance->failure, where equations_settle or
   equations_tangent would. */
bool equations_adjoint(Instance *instance, const Tangent *weights, Seed *sensitivity);

#endif
