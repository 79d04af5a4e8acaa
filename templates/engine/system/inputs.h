/* The inputs during a communication step: polynomials of time. With s the time since the step began,

       u(s) = u + u' s + u'' s^2 / 2 + u''' s^3 / 6

   where u and the derivatives are what the importer set, or 0; those of motions follow from each other. */
#ifndef INPUTS_H
#define INPUTS_H

#include "instance.h"

/* A communication step begins. Derivatives that were not set for it are still those of the end of the last step, and
   are put to 0. A motion whose derivatives were not set is continued by its velocity and acceleration. Otherwise a
   support would stand still while it has a velocity, and the mechanism on it would be late by a communication step. */
void inputs_begin(Instance *instance);

/* The inputs at a time (s) in the running communication step, with their rates; valid until the next call. */
const double *inputs_at(Instance *instance, double time);

/* The communication step ends at the time reached: the State gets the values and derivatives of the inputs there.

   FMI does not say what an input is after a step if it is not set anew. Here it keeps the value of the polynomial at
   the end of the step, without a jump, and is constant in the next step. So outputs that are read at the communication
   point belong to the end of the step that was made, and an input that is read has the value from which they were
   computed. Importers that set their inputs before each step, as all do that set derivatives, see no difference. */
void inputs_end(Instance *instance);

/* Sets the derivative of this order of an input for the next step. The derivatives of the finished step are forgotten
   first. */
void inputs_set_derivative(Instance *instance, int input, int order, double value);

#endif
