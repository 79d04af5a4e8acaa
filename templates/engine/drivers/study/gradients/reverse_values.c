/* Slopes and samples backwards. */
#include <string.h>

#include "adjoint.h"
#include "adjoint_parts.h"
#include "equations.h"
#include "inputs.h"
#include "reverse_rubbing.h"
#include "seeds.h"
#include "tape.h"
#include "values.h"

bool tape_slope_back(Tape *tape, double time, const double point[], const double slope[], const double weights[],
                     const double rubbing[], double found[]) {
    Instance *instance = &tape->variations->study.instance, *probe = &tape->variations->probe;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Seed, sensitivity);
    WORK_OF(mark, Tangent, tangent);
    State *state = &probe->state;
    state->time = time;
    memcpy(state->states, point, N_STATES * sizeof(double));
    memcpy(state->inputs, inputs_at(instance, time), N_SIGNALS * sizeof(double));
    instance_forget_motion(probe);
    if (N_CONSTRAINTS == 0) { /* the slope is all that would be evaluated */
        Cache *cache = &probe->cache;
        memcpy(cache->accelerations, slope + N_COORDINATES, N_COORDINATES * sizeof(double));
        memcpy(cache->reported, slope + N_COORDINATES, N_COORDINATES * sizeof(double));
        memcpy(cache->further, slope + 2 * N_COORDINATES, N_FURTHER * sizeof(double));
        cache->accelerations_valid = true;
    }
    memset(sensitivity, 0, sizeof *sensitivity);
    memset(tangent, 0, sizeof *tangent);
    memcpy(sensitivity->states + N_COORDINATES, weights, N_COORDINATES * sizeof(double));
    memcpy(tangent->accelerations, weights + N_COORDINATES, N_COORDINATES * sizeof(double));
    memcpy(tangent->further, weights + 2 * N_COORDINATES, N_FURTHER * sizeof(double));
    if (rubbing != NULL && equations_accelerations(probe)) {
        reverse_rubbing(probe, rubbing, tangent->accelerations, sensitivity);
    }
    if (!motion_adjoint(probe, tangent, sensitivity)) {
        instance->failure = probe->failure;
        return arena_leave(mark, false);
    }
    tape_add_weighted(found, 1.0, sensitivity->states);
    memset(sensitivity->states, 0, sizeof sensitivity->states);
    seed_add(&tape->total, sensitivity);
    return arena_leave(mark, true);
}

bool tape_sample_back(Tape *tape, int sample, double time, const double point[], double states[]) {
    Variations *variations = tape->variations;
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK_OF(mark, Seed, sensitivity);
    WORK_OF(mark, Tangent, tangent);
    const Request *request = tape->request;
    const double *weights = tape->weights + (size_t)sample * (size_t)request->n_outputs;
    bool whole = false;
    memset(sensitivity, 0, sizeof *sensitivity);
    memset(tangent, 0, sizeof *tangent);
    for (int i = 0; i < request->n_outputs; i++) {
        const Variable *variable = &VARIABLES[request->outputs[i]];
        double *place = adjoint_weight(tangent, sensitivity, variable);
        if (place != NULL) {
            *place += weights[i];
            whole = whole || (weights[i] != 0.0 && value_tangent_order(variable->kind) > 0);
        }
    }
    if (!directions_look(variations, time, point)) {
        return arena_leave(mark, false);
    }
    variations->probe.state.event_held = 1;
    dependent_adjoint(&variations->probe, tangent, sensitivity);
    if (whole && !motion_adjoint(&variations->probe, tangent, sensitivity)) {
        variations->study.instance.failure = variations->probe.failure;
        return arena_leave(mark, false);
    }
    if (!tape_project_back(tape, time, point, variations->probe.state.states, sensitivity->states)) {
        return arena_leave(mark, false);
    }
    tape_add_weighted(states, 1.0, sensitivity->states);
    memset(sensitivity->states, 0, sizeof sensitivity->states);
    seed_add(&tape->total, sensitivity);
    return arena_leave(mark, true);
}
