/* The life of an instance: what model exchange and co-simulation have in common (FMI 3.0, section 2.3). */
#include "life.h"
#include "logging.h"

const char *fmi3GetVersion(void) {
    return fmi3Version;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)resourcePath; /* all data is compiled in */
    (void)visible;
    const Importer importer = {.environment = instanceEnvironment, .log_message = logMessage};
    if (!names_fit(&importer, instanceName, instantiationToken, "instantiation token")) {
        return NULL;
    }
    return component_new(&importer, MODEL_EXCHANGE, instanceName, loggingOn);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    const Importer importer = {.environment = instanceEnvironment, .log_message = logMessage};
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    report_no_instance(&importer, instanceName, "this FMU has no scheduled execution; expected model exchange or "
                       "co-simulation");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) {
    component_free(enter(instance, CALL_FreeInstance));
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    return reset(instance);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    Component *component = enter(instance, CALL_SetDebugLogging);
    unsigned chosen;
    const char *unknown;
    if (component == NULL || choose_categories(component, nCategories, categories, &chosen, &unknown) != fmi3OK) {
        return fmi3Error;
    }
    component->categories = loggingOn ? component->categories | chosen : component->categories & ~chosen;
    return unknown == NULL ? fmi3OK : warn_of_category(component, unknown);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    Component *component = enter(instance, CALL_EnterInitializationMode);
    if (component == NULL ||
        set_up_experiment(component, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime) != fmi3OK) {
        return fmi3Error;
    }
    set_mode(component, MODE_INITIALIZATION);
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    Component *component = enter(instance, CALL_ExitInitializationMode);
    if (component == NULL) {
        return fmi3Error;
    }
    const bool events = component->type == MODEL_EXCHANGE || component->importer.event_mode_used;
    return leave_initialization(component, events ? MODE_EVENT : MODE_STEP);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    return terminate(instance);
}

/* There are no structural parameters, so that these are illegal in all modes, and enter() says so. */
fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    enter(instance, CALL_EnterConfigurationMode);
    return fmi3Error;
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    enter(instance, CALL_ExitConfigurationMode);
    return fmi3Error;
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime) {
    (void)clockReference;
    (void)activationTime;
    enter(instance, CALL_ActivateModelPartition);
    return fmi3Error;
}
