/* The lengths of solver steps. */
#ifndef STEP_SIZE_H
#define STEP_SIZE_H

#include "solver.h"

/* fmin and fmax of the C library are calls, for the sake of NaN. */
static inline double smaller(double a, double b) {
    return a < b ? a : b;
}

static inline double larger(double a, double b) {
    return a > b ? a : b;
}

/* solver_max_step, s. If it is not given, it is a part of the experiment under error control, because the stages of
   longer steps could all miss a force that acts for a short time only. It is infinite for methods of fixed step. */
double longest_step(const State *state);

/* The length of the very first step, s. */
double first_step(Instance *instance);

/* The next trial step: as proposed, or to the end or the horizon if that is about as near. *cut_short: it is shorter
   than proposed, because the communication step ends there. */
Step choose_step(Instance *instance, double end, double horizon, bool *cut_short);

/* Proposes the next step after an accepted one with this error, in units of the tolerance. A step that was cut short
   says little and does not reduce the proposal. */
void propose(State *state, Step step, bool cut_short, double error, bool after_rejection);

/* Proposes a shorter step after one that was rejected: for its error, if that is finite and more than 1. */
void propose_shorter(State *state, Step step, double error);

#endif
