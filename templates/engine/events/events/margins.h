/* Margins of switches: a switch is +1 or -1, and turns where its margin is 0. Functions that return bool return false,
   with instance->failure, where there is no result. */
#ifndef MARGINS_H
#define MARGINS_H

#include "instance.h"

/* The switches, [N_SWITCHES]; they stand in the parameters. */
double *margins_switches(Instance *instance);

/* margins[N_SWITCHES] at a time (s) and states[2n]. */
bool margins_evaluate(Instance *instance, double time, const double states[], double margins[]);

/* Turns the switch k. */
void margins_turn(Instance *instance, int k);

/* *rise: how much more than `from` the margin k is on its side a little later, under the present modes and by the
   accelerations at the present point. Of later and later times the first is taken at which *rise is more than rounding,
   or else the last: margins that turn often, as sin(1/t), have other roots nearby. */
bool margins_rise(Instance *instance, int k, double from, double *rise);

#endif
