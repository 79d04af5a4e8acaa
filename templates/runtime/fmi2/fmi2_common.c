/* The life of an instance: what model exchange and co-simulation have in common (FMI 2.0, sections 2.1.5 and 2.1.6). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "equations.h"
#include "events.h"
#include "gate.h"
#include "logging.h"
#include "massless.h"
#include "settings.h"

const char *fmi2GetTypesPlatform(void) {
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void) {
    return fmi2Version;
}

/* Are the arguments of fmi2Instantiate right? If not, the reason is logged. */
static bool can_instantiate(fmi2String name, fmi2Type type, fmi2String guid, const fmi2CallbackFunctions *functions) {
    if (functions == NULL) {
        return false;
    }
    if (name == NULL || name[0] == '\0') {
        report_no_instance(functions, name, "fmi2Instantiate: the instance name is %s; expected a non-empty name",
                           name == NULL ? "NULL" : "empty");
        return false;
    }
    if (guid == NULL || strcmp(guid, MODEL_GUID) != 0) {
        report_no_instance(functions, name, "fmi2Instantiate: the GUID is \"%s\", but this binary of %s has \"%s\"; "
                           "binary and modelDescription.xml are not from the same export",
                           guid == NULL ? "NULL" : guid, MODEL_NAME, MODEL_GUID);
        return false;
    }
    if (type != fmi2ModelExchange && type != fmi2CoSimulation) {
        report_no_instance(functions, name, "fmi2Instantiate: the type is %d; expected fmi2ModelExchange (0) or "
                           "fmi2CoSimulation (1)", (int)type);
        return false;
    }
    return true;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)fmuResourceLocation; /* all data is compiled in */
    (void)visible;
    if (!can_instantiate(instanceName, fmuType, fmuGUID, functions)) {
        return NULL;
    }
    const size_t name_size = strlen(instanceName) + 1;
    Component *component = calloc(1, sizeof *component + name_size);
    if (component == NULL) {
        report_no_instance(functions, instanceName, "fmi2Instantiate: there is no memory for an instance of %u bytes",
                           (unsigned)(sizeof *component + name_size));
        return NULL;
    }
    memcpy(component->name, instanceName, name_size);
    component->type = fmuType;
    component->callbacks = *functions;
    component->logging_requested = loggingOn != fmi2False;
    component_start(component);
    return component;
}

void fmi2FreeInstance(fmi2Component c) {
    free(c);
}

fmi2Status fmi2Reset(fmi2Component c) {
    Component *component = enter(c, CALL_Reset);
    if (component == NULL) {
        return fmi2Error;
    }
    component_start(component);
    return fmi2OK;
}

/* Adds the category of this name to the set. Returns false if there is none. */
static bool add_category(unsigned *categories, fmi2String name) {
    for (int i = 0; i < N_CATEGORIES; i++) {
        if (strcmp(name, category_name((Category)i)) == 0) {
            *categories |= i == CATEGORY_ALL ? ALL_CATEGORIES : 1u << i;
            return true;
        }
    }
    return false;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    Component *component = enter(c, CALL_SetDebugLogging);
    unsigned chosen = 0u;
    fmi2String unknown = NULL;
    if (component == NULL) {
        return fmi2Error;
    }
    if (nCategories > 0 && categories == NULL) {
        return fail(component, "the array of %u categories is NULL", (unsigned)nCategories);
    }
    for (size_t i = 0; i < nCategories; i++) {
        if (categories[i] == NULL) {
            return fail(component, "the name of category %u is NULL", (unsigned)i);
        }
        unknown = add_category(&chosen, categories[i]) ? unknown : categories[i];
    }
    chosen = nCategories == 0 ? ALL_CATEGORIES : chosen;
    component->categories = loggingOn != fmi2False ? chosen : 0u;
    if (unknown != NULL) {
        return warn(component, "there is no log category \"%s\"; modelDescription.xml lists the categories", unknown);
    }
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    Component *component = enter(c, CALL_SetupExperiment);
    if (component == NULL) {
        return fmi2Error;
    }
    if (toleranceDefined && !(tolerance >= LEAST_TOLERANCE && isfinite(tolerance))) {
        return fail(component, "the tolerance is %g; expected a relative tolerance of at least %g, which rounding "
                    "allows", tolerance, LEAST_TOLERANCE);
    }
    if (!isfinite(startTime)) {
        return fail(component, "the start time is %.17g; expected a finite number", startTime);
    }
    if (stopTimeDefined && !(stopTime >= startTime)) { /* infinite is tolerated: no end */
        return fail(component, "the stop time is %.17g; expected a time after the start time %.17g", stopTime,
                    startTime);
    }
    State *state = &component->instance.state;
    instance_assign(&component->instance, &state->time, startTime);
    state->start_time = startTime;
    instance_forget_cache(&component->instance);
    state->stop_time_defined = stopTimeDefined != fmi2False;
    state->stop_time = stopTimeDefined ? stopTime : 0.0;
    state->tolerance = toleranceDefined ? tolerance : 0.0;
    component->session.experiment_defined = 1;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Component *component = enter(c, CALL_EnterInitializationMode);
    if (component == NULL) {
        return fmi2Error;
    }
    if (!component->session.experiment_defined) {
        note(component, "fmi2SetupExperiment was not called; the start time is 0");
    }
    set_mode(component, MODE_INITIALIZATION);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Component *component = enter(c, CALL_ExitInitializationMode);
    bool jumped;
    if (component == NULL) {
        return fmi2Error;
    }
    if (!equations_settle(&component->instance) || !events_refresh(&component->instance, &jumped)) {
        return report_failure(component, fmi2Error);
    }
    massless_keep(&component->instance.state);
    report_notices(component);
    set_mode(component, component->type == fmi2ModelExchange ? MODE_EVENT : MODE_STEP_COMPLETE);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Component *component = enter(c, CALL_Terminate);
    if (component == NULL) {
        return fmi2Error;
    }
    set_mode(component, MODE_TERMINATED);
    return fmi2OK;
}
