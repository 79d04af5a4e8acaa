/* Steps under error control: the one loop of co-simulation and of runs with derivatives. Steps of one length have
   theirs in integrator.c. */
#ifndef ADAPTIVE_STEPS_H
#define ADAPTIVE_STEPS_H

#include "solver.h"

/* What goes through the steps of the motion with it, as its derivatives do. Functions that return bool return false,
   with instance->failure, where there is no result. */
typedef struct {
    void *of;
    bool (*follow)(void *of, Step step, double *error); /* through the trial step; error: in units of the tolerance */
    bool (*finish)(void *of, Step tried, Step step);    /* at the end of the good step, which an event may have cut */
    bool (*accept)(void *of, Step step);                /* before the end of the step becomes the present point */
    bool (*pass)(void *of);                             /* the event that the present point is at */
} Companion;

/* Steps from the present point to scratch.step_end or beyond it, but not beyond the horizon (s), with dense output for
   a step that goes beyond. `with` may be NULL; else the horizon is scratch.step_end. Returns false, with
   instance->failure, when a step would fall below 16 units in the last place of the time, when there are too many trial
   steps, or when the listener or an event ends the run. Lengths of steps: see step_size.h. */
bool adaptive_steps(Instance *instance, double horizon, const Companion *with);

/* states[N_STATES] at a time (s) in the step of state->dense, on the constraints. Returns false, with
   instance->failure, where constraints cannot be met. */
bool interpolate(Instance *instance, double time, double states[]);

#endif
