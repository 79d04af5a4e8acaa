/* The motion of what is observed: the classical method of Runge and Kutta in steps of one length, and the derivatives
   of its own steps. E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sections II.1 and
   I.14. */
#ifndef OBSERVED_FLOW_H
#define OBSERVED_FLOW_H

#include "instance.h"

/* What of the values of the scratch is asked for: all with their slopes, or a part without. */
typedef enum { OBSERVE_RATES, OBSERVE_OUTPUTS, OBSERVE_SLOPES } Observe;

/* Fills the values of the scratch that are asked for, at a time (s) and a state x[N_OBSERVED]. Returns false, with
   instance->failure, where the equations have no value. */
bool observed_evaluate(Instance *instance, double time, const double x[], Observe asked);

/* Moves x from start to end (s). */
bool observed_move(Instance *instance, double start, double end, double x[]);

/* The spread that the process adds from start to end (s) to none; x is lost. Returns how many of its columns are not 0,
   or -1, with instance->failure. */
int observed_noise(Instance *instance, double start, double end, double x[], double spread[][N_OBSERVED]);

/* Moves x from start to end (s), and the spread, a root of a covariance, with it: the process adds its noise. */
bool observed_flow(Instance *instance, double start, double end, double x[], double spread[][N_OBSERVED]);

#endif
