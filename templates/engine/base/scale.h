/* All tolerances: what counts as 0, as equal, as obeyed. Each says its unit, and why it has this value and not ten
   times it. They derive from the rounding of double, or from the tolerance of the solver; no other file has one.
   Numbers that steer a method without deciding on a result, as the growth of steps, stand with the method. */
#ifndef SCALE_H
#define SCALE_H

#include <float.h>

/* --- rounding, in units of the terms that a quantity is the sum of */

/* What is left where terms cancel. Sums here have some dozens of terms, of which each may be wrong by half a unit; ten
   times less is met by none, and ten times more hides what mechanisms with inertias of 1 : 1e10 do. */
static const double NOISE = 64.0 * DBL_EPSILON;

/* Iterations end with changes of this size: near 500 units of rounding Newton's method goes on no further. */
static const double SOLVED = 1e-13;

/* The residual up to which a condition is met after an iteration has ended: SOLVED, and a decade for the condition of
   its matrix. */
static const double MET = 1e-12;

/* The residual up to which a condition is met whose iteration goes on no further; matrices of condition 1e6 leave no
   less. */
static const double ACCEPTED = 1e-10;

/* In units of the greatest force or impulse: how far each may be from the laws of contact. The errors of ACCEPTED, with
   a decade for the number of rows that share a load. The equations of an implicit step that goes on no further are met
   up to here, too. */
static const double OBEYED = 1e-9;

/* The residual with which iterations are accepted that do not converge; visible in no result of a fixed step. */
static const double TOLERATED = 1e-8;

/* --- ranks, in squares of relative distances */

/* A row that is nearer to the span of the others is redundant. The distance is 1e-5: mechanisms work nearer than 1e-4
   to singular positions, and pass through them on a branch that rounding decides below 1e-6. */
static const double REDUNDANT = 1e-10;

/* A row that has become independent is clearly so only at a distance of 3 %, which drift of the states never makes. */
static const double CLEARLY_INDEPENDENT = 1e-3;

/* A row at a distance of 0.3 % of its usual one is about to be lost: near there rounding errors grow with the inverse
   third power of the distance, and ten times farther the motion is still exact. */
static const double ABOUT_TO_BE_LOST = 1e-5;

/* --- pivots, in units of their own diagonal entry */

/* Elimination leaves a pivot that is 0 with a rounding error of each row. */
#define PIVOT_ZERO (N_COORDINATES * DBL_EPSILON)

/* From here on a pivot without a search for a better one costs more digits than a search does; it keeps 4 digits. */
static const double PIVOT_SUSPICIOUS = 1e4 * DBL_EPSILON;

/* Parts of the largest pivot. Below the first one a singular matrix explains why a solver failed; below the second one,
   a force of a coordinate without mass, or a matrix, may soon do so; below the third one a fixed step may have leapt
   over such a place, whose ends lie farther off. */
static const double SINGULAR_NOW = 1e-6, SINGULAR_SOON = 1e-4, SINGULAR_NEAR = 1e-2;

/* --- positions and velocities, in nominal values of a gap, coordinate or state */

/* A gap of this size is closed, and a velocity rests: what projections leave, which is ACCEPTED. */
static const double AT_REST = 1e-10;

/* The shift of an event's indicator, so that none is 0 after an event; ten times a gap that is closed. Event functions
   may be below 0 by it as long as their mode holds. */
static const double HYSTERESIS = 1e-9;

/* m/s or rad/s; a slip without a lever waits for friction up to here, which a slip of 1e4 is exact to. A hundred times
   more show as a creep where the motion is slow. */
static const double WAITING_SLIP = 1e-11;

/* Values that a user types have 6 digits: starts that miss the constraints by less are moved, gaps that are negative by
   less are closed. */
static const double TYPED = 1e-6;

/* Errors of states at an event that was located: of velocities in a step of the default tolerance. A gap that jumps
   changes by more. */
static const double LOCATED = 1e-6;

/* The same where another solver locates events, as often only at the end of its steps. Relative to the velocities or
   accelerations without forces, it is also the most that forces may leave of them along a row: where none solve a
   singular problem, those that nearly do are 1e9 times too large, and leave most of it. */
static const double LOCATED_LOOSELY = 1e-2;

/* --- times, in parts of a span */

/* A part of a step, or of the experiment, that is too short to matter to its error: steps of equal length differ by
   less, an end is moved by less without repeating the step. */
static const double SLIVER = 1e-6;

/* A part of a span in which nothing shows: of a run that is watched; of the time at which friction may be wrong; and of
   a span that is divided into steps, so that ten steps fill it although rounding makes it longer. Ten times less is
   rounding of sums of steps. */
static const double INSTANT = 1e-9;

/* Of a communication step: importers compute times in many ways, so times are never compared exactly, and a difference
   of less is bridged. A step of another length is not bridged by accident. */
static const double COMMUNICATION_POINT = 1e-3;

/* s; no mechanism moves in it: shorter than the rounding of 1e-14 s. */
static const double LEAST_TIME = 1e-30;

/* --- tolerances of the solver, relative, and what is told in units of them */

/* Errors of steps are at rounding there, and steps shrink without end below. */
static const double LEAST_TOLERANCE = 2e-15;

/* A greater tolerance switches error control off, and says nothing about errors. */
static const double COARSEST_TOLERANCE = 1e-3;

/* Errors of the states in a slip that comes to rest; those of dopri5 are up to 6. */
static const double SLIP_ERROR = 10.0;

/* Drift that stabilised accelerations leave; it is undone by an event. Ten times less is met in each long step. */
static const double DRIFT = 1e3;

/* --- what selects one of several solutions; results that are accepted do not depend on these numbers */

/* A row that yields bears less than its limit by this part, more than margins of shared loads are wrong by; and the
   weight that the size of loads has beside their margins, which keeps loads small that no margin depends on. Margins
   that are below 0 by less are 0: loads at the limits of all laws at once have no room beside them. */
static const double YIELDS = 1e-6;

/* Relative to a diagonal entry: what is added to those of redundant rows, so that their matrix is regular. Their loads
   are then those of least norm, to this relative error. */
static const double DAMPING = 1e-9;

#endif
