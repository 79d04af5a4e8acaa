/* The life of an instance: what model exchange and co-simulation have in common (FMI 2.0, sections 2.1.5 and 2.1.6). */
#include "life.h"
#include "logging.h"

const char *fmi2GetTypesPlatform(void) {
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void) {
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)fmuResourceLocation; /* all data is compiled in */
    (void)visible;
    if (functions == NULL || !names_fit(functions, instanceName, fmuGUID, "GUID")) {
        return NULL;
    }
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation) {
        report_no_instance(functions, instanceName, "the type is %d; expected fmi2ModelExchange (0) or "
                           "fmi2CoSimulation (1)", (int)fmuType);
        return NULL;
    }
    return component_new(functions, fmuType == fmi2ModelExchange ? MODEL_EXCHANGE : CO_SIMULATION, instanceName,
                         loggingOn != fmi2False);
}

void fmi2FreeInstance(fmi2Component c) {
    component_free(enter(c, CALL_FreeInstance));
}

fmi2Status fmi2Reset(fmi2Component c) {
    return reset(c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    Component *component = enter(c, CALL_SetDebugLogging);
    unsigned chosen;
    const char *unknown;
    if (component == NULL || choose_categories(component, nCategories, categories, &chosen, &unknown) != fmi2OK) {
        return fmi2Error;
    }
    component->categories = loggingOn != fmi2False ? chosen : 0u;
    return unknown == NULL ? fmi2OK : warn_of_category(component, unknown);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    Component *component = enter(c, CALL_SetupExperiment);
    if (component == NULL) {
        return fmi2Error;
    }
    component->session.experiment_defined = 1;
    return set_up_experiment(component, toleranceDefined != fmi2False, tolerance, startTime,
                             stopTimeDefined != fmi2False, stopTime);
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
    if (component == NULL) {
        return fmi2Error;
    }
    return leave_initialization(component, component->type == MODEL_EXCHANGE ? MODE_EVENT : MODE_STEP_COMPLETE);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return terminate(c);
}
