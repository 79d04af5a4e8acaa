/* The tolerances of scale.h for numbers of type float, under the same names and with the same meanings: they have 7
   digits instead of 16, so that the steps between the rungs are smaller. Those that are no rounding are the same. */
#ifndef SCALE_H
#define SCALE_H

#include <float.h>

/* --- rounding, in units of the terms that a quantity is the sum of */

static const double NOISE = 16.0 * DBL_EPSILON;
static const double SOLVED = 8.0 * DBL_EPSILON;
static const double MET = 32.0 * DBL_EPSILON;
static const double ACCEPTED = 256.0 * DBL_EPSILON;
static const double OBEYED = 1e-4;
static const double TOLERATED = 1e-3;

/* --- ranks, in squares of relative distances */

static const double REDUNDANT = 1e-6;
static const double CLEARLY_INDEPENDENT = 1e-3;
static const double ABOUT_TO_BE_LOST = 1e-5;

/* --- pivots, in units of their own diagonal entry */

#define PIVOT_ZERO (N_COORDINATES * DBL_EPSILON)
static const double PIVOT_SUSPICIOUS = 1e3 * DBL_EPSILON;
static const double SINGULAR_NOW = 1e-4, SINGULAR_SOON = 1e-3, SINGULAR_NEAR = 1e-2;

/* --- positions and velocities, in nominal values of a gap, coordinate or state */

static const double AT_REST = 1e-5;
static const double HYSTERESIS = 1e-4;
static const double WAITING_SLIP = 1e-4;
static const double TYPED = 1e-4;
static const double LOCATED = 1e-3;
static const double LOCATED_LOOSELY = 1e-2;

/* --- times, in parts of a span */

static const double SLIVER = 1e-4;
static const double INSTANT = 1e-5;
static const double COMMUNICATION_POINT = 1e-3;
static const double LEAST_TIME = 1e-30;

/* --- tolerances of the solver, relative, and what is told in units of them */

static const double LEAST_TOLERANCE = 1e-5;
static const double COARSEST_TOLERANCE = 1e-3;
static const double SLIP_ERROR = 10.0;
static const double DRIFT = 1e3;

/* --- what selects one of several solutions; results that are accepted do not depend on these numbers */

static const double YIELDS = 1e-3;
static const double DAMPING = 1e-5;

#endif
