/* The importer's side: logger, bookkeeping of checks, short forms of calls. */
#include "host.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "mechanism.h"

static int checked = 0;
static int failed = 0;

void check(int holds, const char *expression, const char *file, int line) {
    checked++;
    if (!holds) {
        failed++;
        printf("%s:%d: does not hold: %s\n", file, line, expression);
    }
}

int summary(void) {
    printf("%d checks, %d failed\n", checked, failed);
    return failed;
}

int said(const Log *log, const char *words) {
    return strstr(log->text, words) != NULL;
}

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    Log *log = environment;
    va_list arguments;
    log->count++;
    log->status = status;
    snprintf(log->name, sizeof log->name, "%s", name);
    snprintf(log->category, sizeof log->category, "%s", category);
    snprintf(log->message, sizeof log->message, "%s", message);
    va_start(arguments, message);
    vsnprintf(log->text, sizeof log->text, message, arguments);
    va_end(arguments);
}

fmi2CallbackFunctions callbacks_to(Log *log) {
    fmi2CallbackFunctions callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    callbacks.logger = logger;
    callbacks.componentEnvironment = log;
    return callbacks;
}

fmi2Component instantiate(fmi2Type type, Log *log) {
    const fmi2CallbackFunctions callbacks = callbacks_to(log);
    memset(log, 0, sizeof *log);
    return fmi2Instantiate("under test", type, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2True);
}

fmi2Component start(fmi2Type type, Log *log) {
    fmi2EventInfo info;
    fmi2Component c = instantiate(type, log);
    CHECK(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(fmi2ExitInitializationMode(c) == fmi2OK);
    if (type == fmi2ModelExchange) {
        CHECK(fmi2NewDiscreteStates(c, &info) == fmi2OK);
        CHECK(fmi2EnterContinuousTimeMode(c) == fmi2OK);
    }
    return c;
}

double get(fmi2Component c, fmi2ValueReference reference) {
    double value;
    return fmi2GetReal(c, &reference, 1, &value) == fmi2OK ? value : (double)NAN;
}

fmi2Status set(fmi2Component c, fmi2ValueReference reference, double value) {
    return fmi2SetReal(c, &reference, 1, &value);
}

fmi2Status steps(fmi2Component c, double time, double length, int count) {
    fmi2Status worst = fmi2OK;
    for (int i = 0; i < count; i++) {
        const fmi2Status status = fmi2DoStep(c, time + i * length, length, fmi2True);
        worst = status > worst ? status : worst;
    }
    return worst;
}

size_t snapshot(fmi2Component c, fmi2Byte bytes[]) {
    fmi2FMUstate state = NULL;
    size_t size = 0;
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK);
    CHECK(fmi2SerializedFMUstateSize(c, state, &size) == fmi2OK);
    CHECK(size <= SNAPSHOT_SIZE);
    CHECK(fmi2SerializeFMUstate(c, state, bytes, size) == fmi2OK);
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    CHECK(state == NULL);
    return size;
}

int same_state(fmi2Component a, fmi2Component b) {
    fmi2Byte bytes_a[SNAPSHOT_SIZE], bytes_b[SNAPSHOT_SIZE];
    const size_t size = snapshot(a, bytes_a);
    return size == snapshot(b, bytes_b) && memcmp(bytes_a, bytes_b, size) == 0;
}
