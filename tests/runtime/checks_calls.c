/* Every function in every state: which calls are legal. By the tables of standard_calls.h: x and o must not return
   fmi2Error, . must. */
#include <stdio.h>
#include <string.h>

#include "checks.h"
#include "host.h"
#include "mechanism.h"
#include "standard_calls.h"

enum { N = N_STATES };

static const fmi2ValueReference theta1 = THETA1;

static fmi2Status try_SetupExperiment(fmi2Component c) { return fmi2SetupExperiment(c, fmi2True, 1e-6, 0.0, fmi2True, 10.0); }
static fmi2Status try_SetDebugLogging(fmi2Component c) { return fmi2SetDebugLogging(c, fmi2True, 0, NULL); }
static fmi2Status try_GetReal(fmi2Component c) { double v; return fmi2GetReal(c, &theta1, 1, &v); }
static fmi2Status try_SetReal_input(fmi2Component c) { return set(c, Q_THETA1, 0.5); }
static fmi2Status try_SetReal_state(fmi2Component c) { return set(c, THETA1, 0.5); }
static fmi2Status try_SetReal_tunable(fmi2Component c) { return set(c, L1, 0.5); }
static fmi2Status try_SetReal_fixed(fmi2Component c) { return set(c, SOLVER_TOLERANCE, 1e-4); }
static fmi2Status try_SetTime(fmi2Component c) { return fmi2SetTime(c, 0.5); }
static fmi2Status try_SetReal_calculated(fmi2Component c) { return set(c, REACH, 0.5); }

/* Functions for types that no variable has: with empty lists. */
#define EMPTY(name) static fmi2Status try_##name(fmi2Component c) { return fmi2##name(c, NULL, 0, NULL); }
EMPTY(GetInteger)
EMPTY(GetBoolean)
EMPTY(GetString)
EMPTY(SetInteger)
EMPTY(SetBoolean)
EMPTY(SetString)

static fmi2Status save_and_restore(fmi2Component c) {
    fmi2Byte bytes[SNAPSHOT_SIZE];
    fmi2FMUstate state = NULL;
    size_t size = 0;
    fmi2Status status = fmi2GetFMUstate(c, &state);
    if (status == fmi2OK) status = fmi2SetFMUstate(c, state);
    if (status == fmi2OK) status = fmi2SerializedFMUstateSize(c, state, &size);
    if (status == fmi2OK) status = fmi2SerializeFMUstate(c, state, bytes, size);
    if (status == fmi2OK) status = fmi2FreeFMUstate(c, &state);
    if (status == fmi2OK) status = fmi2DeSerializeFMUstate(c, bytes, size, &state);
    if (status == fmi2OK) status = fmi2FreeFMUstate(c, &state);
    return status;
}

static fmi2Status try_GetDirectionalDerivative(fmi2Component c) {
    double seed = 1.0, result;
    return fmi2GetDirectionalDerivative(c, &theta1, 1, &theta1, 1, &seed, &result);
}
static fmi2Status try_NewDiscreteStates(fmi2Component c) { fmi2EventInfo info; return fmi2NewDiscreteStates(c, &info); }
static fmi2Status try_CompletedIntegratorStep(fmi2Component c) {
    fmi2Boolean event, terminate;
    return fmi2CompletedIntegratorStep(c, fmi2True, &event, &terminate);
}
static fmi2Status try_SetContinuousStates(fmi2Component c) {
    const double x[N] = {0.1, 0.2, 0.3, 0.4};
    return fmi2SetContinuousStates(c, x, N);
}
static fmi2Status try_GetDerivatives(fmi2Component c) { double x[N]; return fmi2GetDerivatives(c, x, N); }
static fmi2Status try_GetEventIndicators(fmi2Component c) { return fmi2GetEventIndicators(c, NULL, 0); }
static fmi2Status try_GetContinuousStates(fmi2Component c) { double x[N]; return fmi2GetContinuousStates(c, x, N); }
static fmi2Status try_GetNominalsOfContinuousStates(fmi2Component c) { double x[N]; return fmi2GetNominalsOfContinuousStates(c, x, N); }
static fmi2Status try_SetRealInputDerivatives(fmi2Component c) {
    return fmi2SetRealInputDerivatives(c, &(fmi2ValueReference){Q_THETA1}, 1, &(fmi2Integer){1}, &(double){0.5});
}
static fmi2Status try_GetRealOutputDerivatives(fmi2Component c) {
    double value;
    return fmi2GetRealOutputDerivatives(c, &theta1, 1, &(fmi2Integer){1}, &value);
}
static fmi2Status try_DoStep(fmi2Component c) { return fmi2DoStep(c, 0.0, 0.01, fmi2True); }
static fmi2Status try_GetStatus(fmi2Component c) { fmi2Status s; return fmi2GetStatus(c, fmi2DoStepStatus, &s); }
static fmi2Status try_GetRealStatus(fmi2Component c) { double t; return fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &t); }
static fmi2Status try_GetIntegerStatus(fmi2Component c) { int i; return fmi2GetIntegerStatus(c, fmi2PendingStatus, &i); }
static fmi2Status try_GetBooleanStatus(fmi2Component c) { fmi2Boolean b; return fmi2GetBooleanStatus(c, fmi2Terminated, &b); }
static fmi2Status try_GetStringStatus(fmi2Component c) { fmi2String s; return fmi2GetStringStatus(c, fmi2PendingStatus, &s); }

#define try_GetFMUstate save_and_restore
#define try_SetFMUstate save_and_restore
#define try_FreeFMUstate save_and_restore
#define try_SerializedFMUstateSize save_and_restore
#define try_SerializeFMUstate save_and_restore
#define try_DeSerializeFMUstate save_and_restore
#define try_EnterInitializationMode fmi2EnterInitializationMode
#define try_ExitInitializationMode fmi2ExitInitializationMode
#define try_Terminate fmi2Terminate
#define try_Reset fmi2Reset
#define try_EnterEventMode fmi2EnterEventMode
#define try_EnterContinuousTimeMode fmi2EnterContinuousTimeMode
#define try_CancelStep fmi2CancelStep

#define ROW(name, model_exchange, co_simulation) {#name, try_##name, model_exchange, co_simulation},
static const struct {
    const char *name;
    fmi2Status (*call)(fmi2Component c);
    const char *model_exchange, *co_simulation;
} TABLE[] = {STANDARD_CALLS(ROW)};

/* A new instance, brought to the state with this letter. */
static fmi2Component in_state(fmi2Type type, char letter, Log *log) {
    if (letter == 'i' || letter == 'z') {
        fmi2Component c = instantiate(type, log);
        CHECK(letter == 'i' || fmi2EnterInitializationMode(c) == fmi2OK);
        return c;
    }
    fmi2Component c = start(type, log);
    if (letter == 'f') {
        CHECK(set(c, M2, 0.0) == fmi2OK);
        CHECK(fmi2DoStep(c, 0.0, 0.01, fmi2True) == fmi2Discard);
    }
    CHECK(letter != 'e' || fmi2EnterEventMode(c) == fmi2OK);
    CHECK(letter != 't' || fmi2Terminate(c) == fmi2OK);
    CHECK(letter != 'x' || set(c, N_REFERENCES, 0.0) == fmi2Error);
    return c;
}

/* One call in one state. */
static void check_call(size_t row, fmi2Type type, char letter, char verdict) {
    Log log;
    fmi2Component c = in_state(type, letter, &log);
    const int before = log.count;
    const fmi2Status result = TABLE[row].call(c);
    char what[80];
    snprintf(what, sizeof what, "%s is %s in state %c of type %d", TABLE[row].name,
             verdict == '.' ? "illegal" : "legal", letter, (int)type);
    check((result == fmi2Error) == (verdict == '.'), what, __FILE__, __LINE__);
    if (verdict == '.') {
        CHECK(log.count == before + 1 && log.status == fmi2Error && strcmp(log.category, "logStatusError") == 0);
        CHECK(set(c, Q_THETA1, 0.0) == fmi2Error); /* now in the error state */
        CHECK(fmi2Reset(c) == fmi2OK && fmi2EnterInitializationMode(c) == fmi2OK);
    }
    CHECK(verdict != 'o' || (log.count == before + 1 && strcmp(log.category, "logAll") == 0));
    fmi2FreeInstance(c);
}

void check_calls(void) {
    for (size_t row = 0; row < sizeof TABLE / sizeof TABLE[0]; row++) {
        for (size_t i = 0; i < strlen(MODEL_EXCHANGE_STATES); i++) {
            check_call(row, fmi2ModelExchange, MODEL_EXCHANGE_STATES[i], TABLE[row].model_exchange[i]);
            check_call(row, fmi2CoSimulation, CO_SIMULATION_STATES[i], TABLE[row].co_simulation[i]);
        }
        CHECK(TABLE[row].call(NULL) == fmi2Error);
    }
    fmi2FreeInstance(NULL);
}

/* Calculated variables and time cannot be set in any state. */
void check_unsettable(void) {
    static const fmi2ValueReference CALCULATED[] = {TIME, THETA1_DDOT, REACH, TOTAL_ENERGY};
    for (size_t i = 0; i < sizeof CALCULATED / sizeof CALCULATED[0]; i++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log);
        CHECK(set(c, CALCULATED[i], 1.0) == fmi2Error);
        CHECK(said(&log, i == 0 ? "independent" : "calculated"));
        fmi2FreeInstance(c);
    }
}
