#include "derivative.h"

#include <string.h>

#include "accelerations.h"
#include "further.h"
#include "inputs.h"
#include "system.h"
#include "tables.h"

/* The rates of the further states. They may depend on multipliers; for redundant constraints these are the multipliers
   of least norm, which are the ones that are shown. */
static bool evaluate_further(Instance *instance, double time, const double states[], const double inputs[],
                             double unknowns[], double rates[]) {
    System *system = &instance->scratch.system;
    if (N_FURTHER == N_RESTING) {
        memset(rates, 0, N_FURTHER * sizeof(double));
        return true;
    }
    if (!multipliers_unique(instance)) {
        if (!system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
            return false;
        }
        multipliers_spread(system, unknowns);
    }
    return further_rates(instance, time, states, inputs, unknowns, rates);
}

bool derivative_at(Instance *instance, double time, const double states[], double derivatives[]) {
    const ArenaMark mark = arena_mark_of(instance->arena, N_UNKNOWNS * sizeof(double));
    WORK(mark, double, solution, N_UNKNOWNS);
    double *accelerations = derivatives + N_COORDINATES;
    double *unknowns = N_UNKNOWNS > N_COORDINATES ? solution : accelerations; /* in place without multipliers */
    const double *inputs = inputs_at(instance, time);
    const bool known = accelerations_at(instance, time, states, inputs, unknowns);
    memcpy(derivatives, states + N_COORDINATES, N_COORDINATES * sizeof(double));
    if (unknowns == solution) {
        memcpy(accelerations, solution, N_COORDINATES * sizeof(double));
    }
    if (!known || !evaluate_further(instance, time, states, inputs, unknowns, derivatives + 2 * N_COORDINATES)) {
        tables_explain(instance, time, states, inputs);
        return arena_leave(mark, false);
    }
    return arena_leave(mark, true);
}
