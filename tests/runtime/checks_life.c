/* Instantiation, logging, reset, the experiment. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "host.h"
#include "mechanism.h"

void check_instantiation(void) {
    Log log = {0};
    fmi2CallbackFunctions callbacks = callbacks_to(&log);
    CHECK(strcmp(fmi2GetVersion(), "2.0") == 0 && strcmp(fmi2GetTypesPlatform(), "default") == 0);

    CHECK(fmi2Instantiate("a", fmi2CoSimulation, "{other#guid 100%s}", NULL, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(log.count == 1 && log.status == fmi2Error && said(&log, "{other##guid 100%s}") && said(&log, MODEL_GUID));
    CHECK(strstr(log.message, "{other##guid 100%%s}") != NULL && strstr(log.message, MODEL_GUID) != NULL);
    CHECK(fmi2Instantiate("a", fmi2CoSimulation, NULL, NULL, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(fmi2Instantiate("", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(fmi2Instantiate(NULL, fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(fmi2Instantiate("a", (fmi2Type)7, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False) == NULL);
    CHECK(log.count == 5);
    CHECK(fmi2Instantiate("a", fmi2CoSimulation, MODEL_GUID, NULL, NULL, fmi2False, fmi2False) == NULL);

    /* all callbacks may be NULL, name and callback struct die after the call */
    char name[] = "mortal";
    memset(&callbacks, 0, sizeof callbacks);
    fmi2Component silent = fmi2Instantiate(name, fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2True);
    CHECK(silent != NULL);
    CHECK(fmi2Instantiate(NULL, fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2True) == NULL);
    CHECK(fmi2DoStep(silent, 0.0, 1.0, fmi2True) == fmi2Error);
    fmi2FreeInstance(silent);

    callbacks = callbacks_to(&log);
    fmi2Component c = fmi2Instantiate(name, fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2True);
    memset(name, 'x', sizeof name - 1);
    memset(&callbacks, 0, sizeof callbacks);
    CHECK(fmi2DoStep(c, 0.0, 1.0, fmi2True) == fmi2Error);
    CHECK(log.count == 6 && strcmp(log.name, "mortal") == 0);
    CHECK(said(&log, "fmi2DoStep: ") && said(&log, "\"instantiated\"") && said(&log, "step complete"));
    fmi2FreeInstance(c);
}

void check_logging(void) {
    static const fmi2String DISCARD[] = {"logStatusDiscard"};
    static const fmi2String ALL[] = {"logAll"};
    static const fmi2String UNKNOWN[] = {"logStatusError", "logWeather#1 100%s"};
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2SetDebugLogging(c, fmi2False, 0, NULL) == fmi2OK);
    CHECK(set(c, THETA2, 1e3) == fmi2Discard && log.count == 0);
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, DISCARD) == fmi2OK);
    CHECK(set(c, THETA2, 1e3) == fmi2Discard && log.count == 1 && strcmp(log.category, "logStatusDiscard") == 0);
    CHECK(!isnan(get(c, THETA2)) && log.count == 1); /* tolerated in "instantiated", noted in logAll, which is off */
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, ALL) == fmi2OK);
    CHECK(fmi2Reset(c) == fmi2OK && !isnan(get(c, THETA2)) && log.count == 2);
    CHECK(!isnan(get(c, THETA2)) && log.count == 2); /* a note is made once */
    CHECK(fmi2SetDebugLogging(c, fmi2True, 2, UNKNOWN) == fmi2Warning && log.count == 2); /* its category is off */
    CHECK(fmi2SetDebugLogging(c, fmi2True, 0, NULL) == fmi2OK);
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, NULL) == fmi2Error && log.count == 3);
    fmi2FreeInstance(c);
}

void check_reset(void) {
    Log log, other_log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    fmi2Component fresh = instantiate(fmi2CoSimulation, &other_log);
    CHECK(set(c, Q_THETA1, 2.0) == fmi2OK && set(c, M1, 3.0) == fmi2OK);
    CHECK(steps(c, 0.0, 0.1, 7) == fmi2OK);
    CHECK(fmi2SetDebugLogging(c, fmi2False, 0, NULL) == fmi2OK);
    CHECK(fmi2Reset(c) == fmi2OK);
    CHECK(same_state(c, fresh));
    for (fmi2ValueReference i = 0; i < N_REFERENCES; i++) {
        CHECK(get(c, i) == get(fresh, i));
    }
    CHECK(fmi2DoStep(c, 0.0, 1.0, fmi2True) == fmi2Error && said(&log, "fmi2DoStep")); /* logging is on again */
    CHECK(fmi2Reset(c) == fmi2OK && same_state(c, fresh)); /* also out of the error state */
    fmi2FreeInstance(c);
    fmi2FreeInstance(fresh);
}

void check_experiment(void) {
    static const struct {
        double tolerance, start, stop;
        fmi2Status status;
    } EXPERIMENTS[] = {
        {1e-6, 0.0, 1.0, fmi2OK},    {1e-6, -5.0, -5.0, fmi2OK},   {1e-6, 0.0, HUGE_VAL, fmi2OK},
        {0.0, 0.0, 1.0, fmi2Error},  {-1.0, 0.0, 1.0, fmi2Error},  {NAN, 0.0, 1.0, fmi2Error},
        {1e-6, NAN, 1.0, fmi2Error}, {1e-6, 1.0, 0.0, fmi2Error},  {1e-6, 0.0, NAN, fmi2Error},
    };
    for (size_t i = 0; i < sizeof EXPERIMENTS / sizeof EXPERIMENTS[0]; i++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log);
        CHECK(fmi2SetupExperiment(c, fmi2True, EXPERIMENTS[i].tolerance, EXPERIMENTS[i].start, fmi2True,
                                  EXPERIMENTS[i].stop) == EXPERIMENTS[i].status);
        CHECK(EXPERIMENTS[i].status != fmi2OK || get(c, TIME) == EXPERIMENTS[i].start);
        fmi2FreeInstance(c);
    }
}
