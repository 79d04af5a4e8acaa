/* Loading, logging and the short forms of calls. */
#include "importer.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void *open_library(const char *path) { return (void *)LoadLibraryA(path); }
static void *symbol(void *library, const char *name) {
    const FARPROC found = GetProcAddress((HMODULE)library, name);
    void *address;
    memcpy(&address, &found, sizeof address);
    return address;
}
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *symbol(void *library, const char *name) { return dlsym(library, name); }
#endif

void expect(int condition, const char *format, ...) {
    if (condition) {
        return;
    }
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "\n");
    exit(1);
}

static void read_description(Fmu *fmu, const char *path) {
    FILE *file = fopen(path, "r");
    expect(file != NULL, "%s cannot be opened", path);
    expect(fscanf(file, "%63s %d %zu %zu %d", fmu->guid, &fmu->constraints, &fmu->states, &fmu->indicators,
                  &fmu->variables) == 5, "no head");
    expect(fmu->variables <= MAX_VARIABLES && fmu->states <= MAX_STATES, "more variables or states than foreseen");
    for (int i = 0; i < fmu->variables; i++) {
        Variable *v = &fmu->variable[i];
        expect(fscanf(file, "%u %c %lf %lf %lf", &v->reference, &v->kind, &v->start, &v->minimum, &v->maximum) == 5,
               "line %d of %s is not right", i + 2, path);
    }
    fclose(file);
}

void load(Fmu *fmu, const char *library, const char *description) {
    void *handle = open_library(library);
    expect(handle != NULL, "%s cannot be loaded", library);
#define FIND(name)                                                               \
    {                                                                            \
        void *address = symbol(handle, "fmi2" #name);                            \
        expect(address != NULL, "%s has no function fmi2%s", library, #name);    \
        memcpy(&fmu->name, &address, sizeof address);                            \
    }
    FUNCTIONS_OF_FMI(FIND)
#undef FIND
    read_description(fmu, description);
}

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    Log *log = environment;
    va_list arguments;
    expect(name != NULL && category != NULL, "a message without a name or category");
    if (status == fmi2OK) {
        return;
    }
    log->count++;
    log->status = status;
    va_start(arguments, message);
    vsnprintf(log->text, sizeof log->text, message, arguments);
    va_end(arguments);
}

fmi2CallbackFunctions callbacks_to(Log *log) {
    fmi2CallbackFunctions callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    memset(log, 0, sizeof *log);
    callbacks.logger = logger;
    callbacks.componentEnvironment = log;
    return callbacks;
}

fmi2Component instantiate(const Fmu *fmu, fmi2Type type, Log *log) {
    const fmi2CallbackFunctions callbacks = callbacks_to(log);
    fmi2Component c = fmu->Instantiate("it", type, fmu->guid, NULL, &callbacks, fmi2False, fmi2True);
    expect(c != NULL, "no instance: %s", log->text);
    return c;
}

fmi2Component start(const Fmu *fmu, fmi2Type type, Log *log) {
    fmi2EventInfo info;
    fmi2Component c = instantiate(fmu, type, log);
    expect(fmu->SetupExperiment(c, fmi2True, 1e-9, 0.0, fmi2False, 0.0) == fmi2OK, "%s", log->text);
    expect(fmu->EnterInitializationMode(c) == fmi2OK, "%s", log->text);
    expect(fmu->ExitInitializationMode(c) == fmi2OK, "%s", log->text);
    if (type == fmi2ModelExchange) {
        expect(fmu->NewDiscreteStates(c, &info) == fmi2OK, "%s", log->text);
        expect(fmu->EnterContinuousTimeMode(c) == fmi2OK, "%s", log->text);
    }
    return c;
}

size_t serialize(const Fmu *fmu, fmi2Component c, fmi2Byte bytes[]) {
    fmi2FMUstate state = NULL;
    size_t size = 0;
    expect(fmu->GetFMUstate(c, &state) == fmi2OK && state != NULL, "no state");
    expect(fmu->SerializedFMUstateSize(c, state, &size) == fmi2OK && size <= MAX_BYTES, "no size, or too large");
    expect(fmu->SerializeFMUstate(c, state, bytes, size) == fmi2OK, "the state cannot be serialized");
    expect(fmu->FreeFMUstate(c, &state) == fmi2OK && state == NULL, "the state cannot be freed");
    return size;
}

size_t references_of(const Fmu *fmu, const char *kinds, fmi2ValueReference references[]) {
    size_t count = 0;
    for (int i = 0; i < fmu->variables; i++) {
        if (strchr(kinds, fmu->variable[i].kind) != NULL) {
            references[count++] = fmu->variable[i].reference;
        }
    }
    return count;
}
