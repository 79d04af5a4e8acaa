/* States that meet the constraints; constraints_none.c is for mechanisms that have none. */
#ifndef CONSTRAINTS_H
#define CONSTRAINTS_H

#include "instance.h"

/* The greatest residual of the positions phi[h] at states[2n], relative to what a change of a coordinate by its nominal
   value makes. */
double constraints_drift(const Instance *instance, double time, const double states[], const double inputs[]);

/* The square of the part that the constraint nearest to being lost has kept of its usual distance, at least
   CLEARLY_INDEPENDENT; 1 where one is held. Errors of the states grow inversely to it, so that drift counts by as much
   more. The system is factorised at the point that is meant. */
double constraints_firmness(const Instance *instance, const System *system);

/* The same of the velocities, at the present states. */
double constraints_velocity_drift(const Instance *instance);

/* Whether what constraints say of the velocities in `to` jumps on the line between the positions of two states[2n] by
   more than the bar, measured as drift is. */
bool constraints_jump(const Instance *instance, double time, const double inputs[], const double from[],
                      const double to[], double bar);

/* Moves states[2n] = [q, qd] the shortest way onto the constraints, measured by M: q first, then qd. Returns false if
   that fails; instance->failure then tells why. *moved says whether the states were changed. Hairer, Wanner, Solving
   Ordinary Differential Equations II, 2nd edition, section VII.2. */
bool constraints_project(Instance *instance, double time, const double inputs[], double states[], bool *moved);

/* The same of qd alone, at the present time and inputs. */
bool constraints_project_velocities(Instance *instance, double states[], bool *moved);

/* Solves for the states that are guesses, such that the constraints hold at the start. Given states that miss them by
   little are moved too, and a remark says how far. Steps are of least norm in nominal values: Deuflhard, Newton Methods
   for Nonlinear Problems, section 4.4. Returns false, with instance->failure, if there is no solution. */
bool constraints_settle(Instance *instance);

/* Finds anew which rows are independent of each other at the present point, after modes switched some of them. Returns
   false, with instance->failure, where the system determines no accelerations. */
bool constraints_regroup(Instance *instance);

/* Adds to a seed of given states, inputs, time and parameters how the solved states answer; the accelerations in the
   cache are up to date. */
void constraints_settle_seed(Instance *instance, Seed *seed);

/* Keeps the accelerations of the motion at the present point, and their derivatives, as the usual ones, and distances
   and slopes of rows that are greater than usual. In a singular position nothing is kept: there the accelerations are
   the usual ones already. */
void constraints_remember(Instance *instance, const Motion *motion);

#endif
