/* From the variables that an importer knows to where their values are. */
#ifndef VALUES_H
#define VALUES_H

#include "instance.h"

/* Is this kind of variable an integer or an enumeration? */
bool value_is_integer(VariableKind kind);

/* Is it a real number? */
bool value_is_real(VariableKind kind);

/* The value of such a variable; a count stops at the greatest int. */
int value_integer(const Instance *instance, const Variable *variable);

/* Where the value of a variable that is a real number lives in the instance. */
double *value_slot(Instance *instance, const Variable *variable);

/* Brings the vector that holds variables of this kind up to date. Returns false, with instance->failure, if the
   equations have no solution. */
bool value_update(Instance *instance, VariableKind kind);

/* Where a known's component is in a seed; NULL for variables that are no knowns: those that follow from others. */
double *value_in_seed(Seed *seed, const Variable *variable);

/* Are variables of this kind unknowns? They follow from others, or are states, which the seed determines. */
bool value_is_unknown(VariableKind kind);

/* Where the derivative of an unknown is along a seed. */
const double *value_in_tangent(const Seed *seed, const Tangent *tangent, const Variable *variable);

/* What the derivative of variables of this kind needs: 0 nothing, 1 equations_tangent, 2 also
   equations_locals_tangent. */
int value_tangent_order(VariableKind kind);

/* The order that equations_motion needs for the time derivative of this order, 1 or 2, of an output. */
int value_motion_order(const Variable *variable, int order);

/* That derivative. */
double value_in_motion(const Motion *motion, const Variable *variable, int order);

#endif
