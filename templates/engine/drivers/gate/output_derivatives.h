/* Time derivatives of outputs in co-simulation, one at a time. */
#ifndef OUTPUT_DERIVATIVES_H
#define OUTPUT_DERIVATIVES_H

#include "gate.h"

/* STATUS_OK if the order is from 1 to highest. */
Status check_order(Component *component, const Variable *variable, int order, int highest);

/* STATUS_OK if the derivative of this order, from 1 to MAX_OUTPUT_ORDER, can be had; raises *needed to the order that
   find_motion must be asked for. */
Status check_output(Component *component, const Variable *variable, int order, int *needed);

/* The motion at the present point, see equations_motion. */
Status find_motion(Component *component, int needed, Motion *motion);

/* STATUS_OK if the derivative, then in *value, is finite. */
Status read_motion(Component *component, const Motion *motion, const Variable *variable, int order, double *value);

#endif
