/* Derivatives of unknowns by knowns, for any choice of

       knowns      time, states, inputs, parameters
       unknowns    states, coordinates and velocities without mass, accelerations, locals, dependent parameters

   The derivative of a coordinate is its velocity, which is a state: its change is read from the seed. */
#ifndef GATED_DERIVATIVES_H
#define GATED_DERIVATIVES_H

#include "gate.h"

/* Adds the change of a known to the seed; STATUS_ERROR if the variable is no known. */
Status add_to_seed(Component *component, Seed *seed, const Variable *variable, double change);

/* STATUS_OK if the variable is a known. */
Status check_known(Component *component, const Variable *variable);

/* STATUS_OK if the variable is an unknown. Raises *needed to its value_tangent_order. */
Status check_unknown(Component *component, const Variable *variable, int *needed);

/* The derivatives along the seed, which is settled first. */
Status find_tangent(Component *component, Seed *seed, int needed, Tangent *tangent);

/* STATUS_OK if the derivative of the unknown, then in *value, is finite. */
Status read_tangent(Component *component, const Seed *seed, const Tangent *tangent, const Variable *variable,
                    double *value);

#endif
