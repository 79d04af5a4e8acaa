#include "scalar_run.h"

#include <string.h>

#include "equations.h"
#include "inputs.h"
#include "integrator.h"

bool run_evaluate(Run *run) {
    Instance *instance = &run->instance;
    double *values = run->quantities;
    if (!integrator_catch_up(instance) || !equations_locals(instance)) {
        return false;
    }
    memcpy(values, instance->state.states, sizeof instance->state.states);
    memcpy(values + AT_UNKNOWNS, instance->cache.shown, sizeof instance->cache.shown);
    memcpy(values + AT_FURTHER_RATES, instance->cache.further, N_FURTHER * sizeof(double));
    memcpy(values + AT_LOCALS, instance->cache.locals, N_LOCALS * sizeof(double));
    memcpy(values + AT_INPUTS, instance->state.inputs, N_INPUTS * sizeof(double));
    return true;
}

void run_set_inputs(Run *run) {
    const Batch *batch = run->batch;
    State *state = &run->instance.state;
    const int64_t first = (batch->inputs_apart ? run->run * batch->knots : 0) + run->knot;
    const double *from = batch->inputs + first * N_INPUTS;
    const bool moves = run->knot + 1 < batch->knots && !batch->hold;
    const double here = batch->knot_times[run->knot];
    const double span = moves ? batch->knot_times[run->knot + 1] - here : 1.0;
    for (int i = 0; i < N_INPUTS; i++) {
        const double slope = moves ? (from[N_INPUTS + i] - from[i]) / span : 0.0;
        instance_assign(&run->instance, &state->inputs[i], from[i] + slope * (state->time - here));
        if (moves) {
            inputs_set_derivative(&run->instance, i, 1, slope);
        }
    }
}

bool run_advance(Run *run, double time) {
    if (!(time > run->instance.state.time)) {
        return true;
    }
    if (batch_stopped(run->batch)) {
        return false;
    }
    if (run->knot + 1 < run->batch->knots) {
        run_set_inputs(run); /* slopes hold for one communication step */
    }
    return integrate(&run->instance, time);
}
