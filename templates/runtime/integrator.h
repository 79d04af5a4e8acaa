/* From the present time to the end of a communication step, in the solver's own steps. */
#ifndef INTEGRATOR_H
#define INTEGRATOR_H

#include "instance.h"

/* One trial step from the present point. */
typedef struct {
    double length;  /* s */
    double end;     /* the time where it ends, s */
    bool cut_short; /* shorter than proposed, because the communication step ends there */
} Step;

/* Advances time, states and inputs of instance->state to exactly end, s. Returns false if a step could not be completed;
   all are then those of the last one that was, and instance->failure tells why. */
bool integrate(Instance *instance, double end);

/* runge_kutta.c: one trial step with the method TABLEAU, from the present point and its state->first_stage. Fills
   scratch new_states and new_derivatives; the State is not changed. Returns false, with instance->failure set, if one
   of them is not finite. */
bool runge_kutta_step(Instance *instance, Step step);

/* runge_kutta.c: the error estimate of the last trial step, the maximum over the states of |error_i| / weight_i with
   weight_i = tolerance * (max(|x_i|, |x_new_i|) + nominal_i); worst is the index of that state. */
double runge_kutta_error(const Instance *instance, Step step, double tolerance, int *worst);

#endif
