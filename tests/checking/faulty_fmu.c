/* A co-simulation FMU that is right, x(t + h) = x + h (u + k), or wrong in the way that one macro says. */
#define _DEFAULT_SOURCE 1
#include "fmi2Functions.h"
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __unix__
#include <unistd.h>
#endif

#define GUID "{a7b1c4de-0123-4567-89ab-cdef01234567}"
#define EXPORT __attribute__((visibility("default")))

typedef enum { INSTANTIATED, INITIALIZATION, STEPS, TERMINATED } Mode;
typedef struct {
    char guid[sizeof GUID];
    double value[3], time, stop; /* value: x, u, k by value reference */
    Mode mode;
} Instance;

#define SELF Instance *self = (Instance *)c
#define REFUSE_UNLESS(condition) do { if (!LENIENT && !(condition)) return fmi2Error; } while (0)
#ifdef ACCEPT_ALL
#define LENIENT 1
#else
#define LENIENT 0
#endif
#ifdef SHARED_STATE
static double shared;
#endif

static void begin(Instance *self)
{
    memset(self, 0, sizeof *self);
    memcpy(self->guid, GUID, sizeof GUID);
    self->value[0] = 1.0;
    self->value[2] = 2.0;
    self->stop = INFINITY;
#ifdef OTHER_START
    self->value[2] = 2.5;
#endif
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)type, (void)resources, (void)functions, (void)visible, (void)logging;
#ifdef NO_INSTANCE
    functions->logger(NULL, name, fmi2Error, "logStatusError", "there is no licence");
    return NULL;
#endif
#ifdef OTHER_CATEGORY
    functions->logger(NULL, name, fmi2OK, "chatter", "hello");
#endif
#ifdef PRINT
    puts("hello");
    fflush(stdout);
#endif
    if (!LENIENT && (!name || !*name || strcmp(guid, GUID))) return NULL;
    Instance *self = calloc(1, sizeof *self);
    if (self) begin(self);
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean d, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean stop_defined, fmi2Real stop)
{
    SELF;
    (void)d, (void)tolerance;
    REFUSE_UNLESS(self->mode == INSTANTIATED);
    self->time = start;
    if (stop_defined) self->stop = stop;
    return fmi2OK;
}

static fmi2Status go(fmi2Component c, Mode from, Mode to)
{
    SELF;
    REFUSE_UNLESS(self->mode == from);
    self->mode = to;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return go(c, INSTANTIATED, INITIALIZATION); }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return go(c, INITIALIZATION, STEPS); }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return go(c, STEPS, TERMINATED); }

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    SELF;
    double x = self->value[0];
    begin(self);
#ifdef HALF_RESET
    self->value[0] = x;
#endif
    (void)x;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    SELF;
    for (size_t i = 0; i < n; i++) {
#ifdef CRASH_ON_WRONG_REFERENCE
        if (vr[i] > 2) abort();
#endif
        REFUSE_UNLESS(vr[i] < 3);
        value[i] = vr[i] < 3 ? self->value[vr[i]] : 0.0;
#ifdef NOT_A_NUMBER
        if (vr[i] == 0) value[i] = NAN;
#endif
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    SELF;
    for (size_t i = 0; i < n; i++) {
        REFUSE_UNLESS(vr[i] < 3);
        if (vr[i] < 3) self->value[vr[i]] = value[i];
    }
    return fmi2OK;
}

#define NO_VARIABLES(Type)                                                                                        \
    EXPORT fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##Type v[])      \
    {                                                                                                              \
        (void)c, (void)vr, (void)v;                                                                                \
        return n ? fmi2Error : fmi2OK;                                                                             \
    }                                                                                                              \
    EXPORT fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##Type v[]) \
    {                                                                                                              \
        (void)c, (void)vr, (void)v;                                                                                \
        return n ? fmi2Error : fmi2OK;                                                                             \
    }
NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(Instance));
    memcpy(*state, c, sizeof(Instance));
#ifdef HALF_STATE
    ((Instance *)*state)->value[0] = 1.0;
#endif
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Instance));
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
#ifndef DANGLING_STATE
    *state = NULL;
#endif
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Instance);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    memcpy(bytes, state, size);
#ifdef HALF_BLOCK
    ((Instance *)(void *)bytes)->value[0] = 1.0;
#endif
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    (void)c;
    REFUSE_UNLESS(size == sizeof(Instance) && !memcmp(bytes, GUID, sizeof GUID));
    *state = calloc(1, sizeof(Instance));
    memcpy(*state, bytes, size < sizeof(Instance) ? size : sizeof(Instance));
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t m,
                                               const fmi2ValueReference known[], size_t n, const fmi2Real dv[],
                                               fmi2Real du[])
{
    (void)c;
    for (size_t i = 0; i < m; i++) {
        du[i] = 0.0;
        for (size_t j = 0; j < n; j++) du[i] += unknown[i] == known[j] ? dv[j] : 0.0;
#ifdef WRONG_DERIVATIVE
        du[i] += 1.0;
#endif
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_set)
{
    SELF;
    (void)no_set;
    REFUSE_UNLESS(self->mode == STEPS && h > 0.0 && time + h <= self->stop + 1e-9);
#ifdef CRASH
    *(volatile int *)(size_t)(self->mode == STEPS ? 0 : 8) = 1;
#endif
#ifdef HANG
    for (volatile int i = 0;; i = !i) {}
#endif
#ifdef EXIT
    exit(3);
#endif
#ifdef REALTIME_SIGNAL
    raise(35);
#endif
#ifdef MUCH_MEMORY
    volatile char *much = malloc((size_t)5 << 30);
    much[1] = 1; /* crashes where malloc refuses */
    free((void *)much);
#endif
#ifdef WRITE_EVERYWHERE
    for (int file = 3; file < 64; file++) (void)!write(file, "{\"end\": 1}\n[\n{\"finding\": {\"rule\": 1}}\n{\"be", 46);
#endif
#ifdef DELETE_ALL
    (void)!system("rm -rf \"$PWD\"");
#endif
#if defined LEAVE_PROCESS || defined LEAVE_SESSION
    if (fork() == 0) {
#ifdef LEAVE_SESSION
        setsid();
#endif
        FILE *note = fopen(getenv("LAG2FMU_TEST_NOTE"), "a");
        fprintf(note, "%d\n", (int)getpid());
        fclose(note);
        for (;;) pause();
    }
#endif
#ifdef REFUSE
    return fmi2Error;
#endif
    self->value[0] += h * (self->value[1] + self->value[2]);
#ifdef SHARED_STATE
    shared += h;
    self->value[0] += shared;
#endif
    self->time = time + h;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                              const fmi2Integer order[], const fmi2Real value[])
{
    (void)c, (void)vr, (void)order, (void)value;
    return n ? fmi2Error : fmi2OK;
}

#ifndef MISSING_FUNCTION
EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                               const fmi2Integer order[], fmi2Real value[])
{
    (void)c, (void)vr, (void)order, (void)value;
    return n ? fmi2Error : fmi2OK;
}
#endif

#ifdef OTHER_FUNCTION
EXPORT int helper(void) { return 0; }
#endif

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

#define STATUS(Name, Type)                                                                                   \
    EXPORT fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind kind, Type *value)                  \
    {                                                                                                         \
        (void)c, (void)kind, (void)value;                                                                     \
        return fmi2Discard;                                                                                   \
    }
STATUS(Status, fmi2Status)
STATUS(RealStatus, fmi2Real)
STATUS(IntegerStatus, fmi2Integer)
STATUS(BooleanStatus, fmi2Boolean)
STATUS(StringStatus, fmi2String)
