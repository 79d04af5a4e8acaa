/* The parts of a step of ROS2 (ros2.c) that its derivatives take again. */
#ifndef ROS2_H
#define ROS2_H

#include "solver.h"

static const double GAMMA = 0.2928932188134524755991556; /* 1 - 1/sqrt(2) */

/* Both stages of a step from the present point: k1, k2, J and the factors in scratch.solver, x + h k1 in
   scratch.stage_states, and f2[N_STATES], the derivative there. Returns false, with instance->failure, if there are
   none. */
bool ros2_stages(Instance *instance, Step step, double f2[]);

/* Overwrites r[N_STATES] by the solution k of (I - g h J) k = r, with the J and the factors in work. */
void ros2_solve(Arena *arena, const SolverScratch *work, double h, double r[]);

#endif
