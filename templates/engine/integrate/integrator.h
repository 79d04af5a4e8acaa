/* From the present time to the end of a communication step, in the solver's own steps. */
#ifndef INTEGRATOR_H
#define INTEGRATOR_H

#include "adaptive_steps.h"

/* Advances time, states and inputs of instance->state to exactly end, s. If the listener follows steps or awaits
   events, the end may be earlier. Returns false if a step could not be completed; time, states and inputs are then
   those at the end of the last completed step, and instance->failure tells why. Where the solver has gone beyond the
   end, the states stay behind until something asks for them: most communication steps then only move the time. Lengths
   of steps by Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, II.4. */
bool integrate(Instance *instance, double end);

/* Goes to scratch.step_end in equal steps, as many as make them no longer than solver_step. `with` may be NULL. Returns
   false, with instance->failure, as integrate does. */
bool integrate_in_equal_steps(Instance *instance, const Companion *with);

/* Brings the states to the present time if they are behind. Returns false, with instance->failure set, if constraints
   cannot be met there. */
bool integrator_catch_up(Instance *instance);

/* Passes the event that the last communication step ended at, and brings the modes up to date with what was assigned.
   Returns false, with instance->failure set, if that fails. */
bool integrator_settle(Instance *instance);

/* The short path for the most frequent communication step: like the last one it ends within a solver step, so that only
   the time moves. Returns whether this is the case. Such a solver step does not pass the stop time. */
static inline bool integrator_pass(Instance *instance, double end) {
    const bool within = instance->cache.states_behind && end < instance->state.dense.end;
    if (within) {
        instance->state.time = end;
    }
    return within;
}

#endif
