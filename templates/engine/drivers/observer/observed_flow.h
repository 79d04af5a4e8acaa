/* The motion of what is observed: the classical method of Runge and Kutta in steps of one length, and the derivatives
   of its own steps. E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sections II.1 and
   I.14. */
#ifndef OBSERVED_FLOW_H
#define OBSERVED_FLOW_H

#include "instance.h"

/* Fills the values of the scratch at a time (s) and a state x[N_OBSERVED], and its slopes too if they are asked for.
   Returns false, with instance->failure, where the equations have no value. */
bool observed_evaluate(Instance *instance, double time, const double x[], bool slopes);

/* Moves x from start to end (s). */
bool observed_move(Instance *instance, double start, double end, double x[]);

/* Moves x from start to end (s), and the spread, a root of a covariance, with it: the process adds its noise. */
bool observed_flow(Instance *instance, double start, double end, double x[], double spread[][N_OBSERVED]);

#endif
