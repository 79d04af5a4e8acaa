/* The states within a solver step, for communication points that the solver steps over. With theta = 0 ... 1 in it

       x(theta) = x + theta (f0 + (1 - theta) (f1 + theta (f2 + (1 - theta) (f3 + theta (f4 + ...)))))

   where f0, f1, f2 make Hermite's cubic of both ends and solver_dense gives the rest. Hairer, Norsett, Wanner, Solving
   Ordinary Differential Equations I, 2nd edition, section II.6.

   A method of second order ends the step with an error as great as what a gap rises by when its last force has
   vanished: the cubic would fall below 0, and the contact close again. Where there are events, coordinates follow the
   parabola instead, f2 = 0, as the results of shorter steps do. */
#ifndef DENSE_OUTPUT_H
#define DENSE_OUTPUT_H

#include "solver.h"

/* Fills state->dense for the trial step in scratch, which is about to be accepted. Returns false, with
   instance->failure set, if an evaluation for it fails. */
bool dense_begin(Instance *instance, Step step);

/* Fills state->dense for the trial step with Hermite's cubic alone, which takes no evaluation. */
void dense_begin_cubic(Instance *instance, Step step);

/* states[2n] of the cubic alone at theta. */
static inline void dense_cubic_states(const Dense *dense, double theta, double states[]) {
    for (int i = 0; i < N_STATES; i++) {
        const double bend = dense->terms[1][i] + theta * dense->terms[2][i];
        states[i] = dense->states[i] + theta * (dense->terms[0][i] + (1.0 - theta) * bend);
    }
}

/* states[2n] at a time (s) in that step. */
void dense_states(const Dense *dense, double time, double states[]);

#endif
