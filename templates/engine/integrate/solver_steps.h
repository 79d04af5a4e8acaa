/* What each solver step of a communication step begins and ends with. Its end is told to the listener, and events are
   passed there, or wait. */
#ifndef SOLVER_STEPS_H
#define SOLVER_STEPS_H

#include "solver.h"

/* Are there events that end steps? Time stepping takes them within its steps. */
enum { ENDS_AT_EVENTS = N_EVENTS > 0 && !TIME_STEPPING };

/* Makes state->first_stage the derivative at the present point, on the constraints as the inputs now move them. Time
   stepping does without. */
bool update_first_stage(Instance *instance);

/* A trial step begins that may have to be repeated. */
void begin_trial(Instance *instance, Step step);

/* If there are events in the good trial step, repeats it so that it ends at the first one. */
bool end_at_event(Instance *instance, Step *step);

/* If the present point is at an event, passes it: the equations of motion change. */
bool pass_event(Instance *instance);

/* Makes the result of a trial step the present point. */
void accept_step(Instance *instance, Step step);

/* The present point is the end of a solver step: tells so, and passes an event. */
bool end_solver_step(Instance *instance);

/* Is the present point at an event that waits for integrator_settle? */
static inline bool step_waits(const Instance *instance) {
    const State *state = &instance->state;
    return N_EVENTS > 0 && instance->listener.awaits_events && state->event_pending && !state->ahead;
}

/* Is the communication step to be continued? */
static inline bool step_goes_on(const Instance *instance) {
    return instance->state.time < instance->scratch.step_end && !step_waits(instance);
}

#endif
