#include "importer_steps.h"

#include <string.h>

#include "constraints.h"
#include "contacts.h"
#include "equations.h"
#include "events.h"
#include "massless.h"
#include "notices.h"
#include "settings.h"

/* The stabilised accelerations keep the drift at the tolerance of the importer's solver. Where that was not enough, by
   this factor, the states are pulled back by an event. */
static const double TOLERATED_DRIFT = 1e3;

static bool drifted(const Instance *instance) {
    const State *state = &instance->state;
    return constraints_drift(instance, state->time, state->states, state->inputs) >
           TOLERATED_DRIFT * solver_tolerance(state);
}

bool importer_completes_step(Instance *instance) {
    begin_notices(instance);
    watch_motions(instance);
    keep_motions(&instance->state);
    if (!equations_massless(instance)) {
        return false;
    }
    watch_ranges(instance);
    massless_keep(&instance->state);
    equations_remember(instance);
    return drifted(instance) || !contacts_oppose(instance, instance->state.time, instance->state.states, NULL);
}

void importer_enters_event(Instance *instance) {
    if (equations_massless(instance)) {
        massless_keep(&instance->state);
    }
}

/* Moves the states onto the constraints. */
static bool pull_back(Instance *instance, bool *changed) {
    State *state = &instance->state;
    double states[N_STATES];
    bool moved;
    memcpy(states, state->states, sizeof states);
    if (!constraints_project(instance, state->time, state->inputs, states, &moved)) {
        return false;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        const int k = CONTINUOUS_STATES[i];
        *changed = *changed || memcmp(&states[k], &state->states[k], sizeof(double)) != 0;
    }
    for (int i = 0; i < N_STATES; i++) {
        instance_assign(instance, &state->states[i], states[i]);
    }
    massless_keep(state);
    return true;
}

static bool meet_constraints(Instance *instance, bool *changed) {
    if (massless_return(instance)) {
        return pull_back(instance, changed);
    }
    return equations_massless(instance) && (!drifted(instance) || pull_back(instance, changed));
}

bool importer_updates_states(Instance *instance, bool *changed) {
    bool jumped;
    *changed = false;
    if (!meet_constraints(instance, changed)) {
        return false;
    }
    instance->state.modes_settled = 0;
    if (!events_refresh(instance, &jumped) || !events_go_on(instance)) {
        return false;
    }
    *changed = *changed || jumped;
    return true;
}

double importer_next_event(Instance *instance) {
    return events_next_time(instance);
}

void importer_leaves_event(Instance *instance) {
    equations_remember(instance);
}
