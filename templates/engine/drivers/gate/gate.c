/* Starting components, and which calls are let through. */
#include "gate.h"

#include <string.h>

#include "integrator.h"
#include "logging.h"
#include "names.h"

/* Says with the running function how far a given start was moved. */
static void say_start_moved(void *owner, int state, double given, double taken) {
    note((Component *)owner, "the given start values missed the constraints by little and were moved, furthest %s from "
         "%.17g to %.17g", state_name(state), given, taken);
}

void component_start(Component *component) {
    component->instance.policy = component->type == MODEL_EXCHANGE ? &IMPORTERS_SOLVER : &OWN_SOLVER;
    component->instance.listener.start_moved = say_start_moved;
    component->instance.listener.owner = component;
    instance_start(&component->instance);
    memset(&component->session, 0, sizeof component->session);
    component->session.type = component->type;
    set_mode(component, MODE_INSTANTIATED);
    memset(component->noted_calls, 0, sizeof component->noted_calls);
    memset(component->noted_kinds, 0, sizeof component->noted_kinds);
    component->noted_singularity = false;
    component->categories = component->logging_requested ? ALL_CATEGORIES : 0u;
}

/* Says why a call is illegal in a mode and where it would be legal. */
static void report_illegal_call(Component *component, Call call, Mode mode) {
    char modes[160];
    legal_modes(call, component->type, modes, sizeof modes);
    const char *type = type_name(component->type);
    if (modes[0] == '\0') {
        fail(component, "an instance for %s has no use for this function in any state; do not call it", type);
    } else {
        fail(component, "illegal in state \"%s\" of an instance for %s; expected one of the states: %s",
             mode_name(mode), type, modes);
    }
}

Component *enter(void *handle, Call call) {
    Component *component = (Component *)handle;
    if (component == NULL) {
        return NULL;
    }
    if (component->logging) {
        component->called_back = call_name(call);
        return NULL;
    }
    const Mode mode = mode_of_calls(&component->importer, &component->session);
    const Verdict verdict = legal_call(call, component->type, mode);
    component->call = call;
    if (verdict == VERDICT_ILLEGAL) {
        report_illegal_call(component, call, mode);
        return NULL;
    }
    if (verdict == VERDICT_TOLERATED && !component->noted_calls[call]) {
        component->noted_calls[call] = true;
        note(component, "accepted in state \"%s\", although the standard does not foresee it there", mode_name(mode));
    }
    return component;
}

Component *enter_present(void *handle, Call call) {
    Component *component = enter(handle, call);
    if (component != NULL && !integrator_catch_up(&component->instance) && component->session.mode != MODE_ERROR) {
        report_failure(component, STATUS_ERROR);
        return NULL;
    }
    return component;
}

Component *enter_with(void *handle, Call call, const void *address, const char *what) {
    Component *component = enter(handle, call);
    if (component != NULL && address == NULL) {
        fail(component, "the argument %s is NULL; expected an address", what);
        return NULL;
    }
    return component;
}
