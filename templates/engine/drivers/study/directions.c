#include "directions.h"

#include <math.h>
#include <string.h>

#include "accelerations.h"
#include "contacts.h"
#include "equations.h"
#include "further.h"
#include "inputs.h"
#include "projection.h"
#include "scale.h"
#include "solver_steps.h"
#include "system.h"
#include "values.h"

bool directions_evaluate(Variations *variations, double time, const double states[]) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, inputs, N_SIGNALS);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, change, N_RESIDUALS);
    WORK(mark, double, answer, N_UNKNOWNS);
    Instance *instance = &variations->study.instance;
    System *system = &instance->scratch.system;
    memcpy(inputs, inputs_at(instance, time), N_SIGNALS * sizeof(double));
    if (!accelerations_at(instance, time, states, inputs, unknowns) ||
        !system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
        return arena_leave(mark, false);
    }
    if (N_FURTHER > 0 && !multipliers_unique(instance)) {
        multipliers_spread(system, unknowns);
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        const Seed *seed = &direction->seed;
        mechanism_residual_tangent(time, states, inputs, instance->state.parameters, unknowns, seed->time,
                                   seed->states, seed->inputs, seed->parameters, change);
        system_answer(system, change, answer);
        contacts_answer(instance, system, time, states, inputs, unknowns, seed, answer);
        memcpy(direction->rates, seed->states + N, N * sizeof(double));
        memcpy(direction->rates + N, answer, N * sizeof(double));
        further_tangent(instance, time, states, inputs, unknowns, seed, answer, direction->rates + 2 * N);
    }
    return arena_leave(mark, true);
}

bool directions_settle(Variations *variations) {
    const State *state = &variations->study.instance.state;
    if (!directions_project(variations, state->time, state->states, state->states) ||
        !directions_evaluate(variations, state->time, state->states)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->states, direction->seed.states, sizeof direction->states);
        memcpy(direction->slope, direction->rates, sizeof direction->slope);
    }
    return true;
}

/* The derivatives along a direction of what is read at the probe's point. */
static bool sample_slopes(Variations *variations, const Request *request, int d, double slopes[]) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK_OF(mark, Tangent, tangent);
    Instance *probe = &variations->probe;
    const Seed *seed = &variations->directions[d].seed;
    int needed = 0;
    for (int i = 0; i < request->n_outputs; i++) {
        const int order = value_tangent_order(VARIABLES[request->outputs[i]].kind);
        needed = order > needed ? order : needed;
    }
    equations_dependent_tangent(probe, seed, tangent);
    if (needed > 0 && !equations_tangent(probe, seed, tangent)) {
        return arena_leave(mark, false);
    }
    if (needed > 1) {
        equations_locals_tangent(probe, seed, tangent);
    }
    for (int i = 0; i < request->n_outputs; i++) {
        slopes[i * variations->count + d] = *value_in_tangent(seed, tangent, &VARIABLES[request->outputs[i]]);
    }
    return arena_leave(mark, true);
}

bool directions_look(Variations *variations, double time, const double states[]) {
    Instance *instance = &variations->study.instance, *probe = &variations->probe;
    bool moved;
    probe->state = instance->state;
    probe->state.time = time;
    probe->state.ahead = 0;
    memcpy(probe->state.inputs, inputs_at(instance, time), N_SIGNALS * sizeof(double));
    memcpy(probe->state.states, states, N_STATES * sizeof(double));
    probe->scratch.inputs_move = false;
    instance_forget_cache(probe);
    if (!project(probe, time, probe->state.states, &moved)) {
        instance->failure = probe->failure;
        return false;
    }
    return true;
}

bool directions_sample(Variations *variations, double time, const double states[]) {
    Instance *instance = &variations->study.instance, *probe = &variations->probe;
    const Request *request = variations->request;
    const size_t place = (size_t)variations->next * (size_t)request->n_outputs;
    if (!directions_look(variations, time, states) ||
        !directions_project(variations, time, states, probe->state.states)) {
        return false;
    }
    if (!study_read(probe, request, request->values + place)) {
        instance->failure = probe->failure;
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        if (!sample_slopes(variations, request, d, request->slopes + place * (size_t)variations->count)) {
            instance->failure = probe->failure;
            return false;
        }
    }
    return true;
}

bool directions_stand(Variations *variations, Instance *instance) {
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        if (!equations_settle_seed(instance, &direction->seed)) {
            return study_explain(&variations->study);
        }
        memcpy(direction->states, direction->seed.states, sizeof direction->states);
    }
    return true;
}

double direction_rounding(Variations *variations, const Direction *direction) {
    double greatest = 0.0;
    for (int i = 0; i < N_STATES; i++) {
        const double size = larger(fabs(direction->states[i]), fabs(direction->new_states[i]));
        greatest = larger(greatest, size / NOMINAL_STATES[i]);
    }
    return NOISE * larger(1.0, contacts_slowness(&variations->study.instance)) * greatest;
}
