/* An FMU of FMI 2.0, for model exchange and co-simulation, that is right, or wrong in the way that FAULT in the
   environment says:  dx0/dt = u - k x0,  dx1/dt = f x0 - x1,  y = x0 x1 + u,  an event where x0 falls below 1/2. */
#define _DEFAULT_SOURCE 1
#include "fmi2Functions.h"
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#ifdef __unix__
#include <unistd.h>
#endif

#define GUID "{a7b1c4de-0123-4567-89ab-cdef01234567}"
#define EXPORT __attribute__((visibility("default")))
#define CANARY 1e300

enum { INSTANTIATED = 1, INITIALIZATION = 2, EVENT = 4, CONTINUOUS = 8, STEP = 16, TERMINATED = 32 };
enum { TIME, X0, X1, RATE0, RATE1, U, K, F, Y, SEVEN, N_REALS, MODE = 20, COUNT = 21 };

typedef struct {
    char guid[sizeof GUID];
    double time, start, stop, x[2], u, k, f, kept[N_REALS];
    int mode, count, state, reads;
    bool stale;
} Memory;

typedef struct {
    Memory m;
    bool exchange;
    const fmi2CallbackFunctions *functions;
} Instance;

static double shared;

static bool fault(const char *name)
{
    const char *wanted = getenv("FAULT");
    return wanted && !strcmp(wanted, name);
}

static fmi2Status fail(Instance *self, const char *sentence)
{
    self->functions->logger(NULL, "faulty", fmi2Error, "logStatusError", sentence);
    return fmi2Error;
}

#define SELF Instance *self = (Instance *)c
#define DEMAND(condition, sentence) do { if (!(condition)) return fail(self, sentence); } while (0)
#define ALLOW(states, unless) DEMAND((self->m.state & (states)) || fault(unless), "this call is not legal now")

static void begin(Memory *m)
{
    double x = m->x[0];
    memset(m, 0, sizeof *m);
    memcpy(m->guid, GUID, sizeof GUID);
    m->x[0] = fault("HALF_RESET") && x != 0.0 ? x : 1.0;
    m->x[1] = 2.0;
    m->u = 0.5;
    m->k = fault("OTHER_START") ? 2.5 : 2.0;
    m->f = fault("ROUNDED_START") ? 3.0000000001 : 3.0;
    m->mode = 1;
    m->stop = INFINITY;
    m->state = INSTANTIATED;
}

static void rates(const Memory *m, double dx[2])
{
    dx[0] = (fault("IGNORED_INPUT") ? 0.5 : m->u) - (fault("IGNORED_PARAMETER") ? 2.0 : m->k) * m->x[0];
    dx[1] = (fault("IGNORED_FIXED") ? 3.0 : m->f) * m->x[0] - m->x[1];
    if (fault("RATE_NAN")) dx[1] = NAN;
}

static double value_of(const Memory *m, fmi2ValueReference vr)
{
    double dx[2];
    rates(m, dx);
    switch (vr) {
    case TIME: return fault("TIME_STANDS") ? m->start : m->time;
    case X0: return m->x[0];
    case X1: return m->x[1];
    case RATE0: return dx[0];
    case RATE1: return dx[1];
    case U: return m->u;
    case K: return m->k;
    case F: return m->f;
    case Y:
        if (fault("NOT_A_NUMBER") || (fault("LATE_NAN") && m->time > m->start + 0.5)) return NAN;
        return m->x[0] * m->x[1] + (fault("IGNORED_INPUT") ? 0.5 : m->u);
    default: return 7.0;
    }
}

/* ------------------------------------------------------------------------------------------------------ instances */

EXPORT const char *fmi2GetTypesPlatform(void) { return fault("PLATFORM") ? "other" : "default"; }
EXPORT const char *fmi2GetVersion(void) { return fault("VERSION") ? "2.1" : "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)resources, (void)visible, (void)logging;
    if (fault("CHDIR") && chdir("/")) return NULL;
    if (fault("LOCALE")) setlocale(LC_NUMERIC, strcmp(setlocale(LC_NUMERIC, NULL), "C") ? "C" : "C.UTF-8");
    fesetround(fault("ROUNDING") ? FE_UPWARD : FE_TONEAREST);
    if (fault("NO_INSTANCE") || (fault("NO_EXCHANGE") && type == fmi2ModelExchange)) return NULL;
    if (strcmp(guid, GUID) && !fault("ANY_TOKEN")) return NULL;
    Instance *self = calloc(1, sizeof *self);
    self->exchange = type == fmi2ModelExchange;
    self->functions = functions;
    if (fault("CATEGORY")) functions->logger(NULL, name, fmi2OK, "chatter", "hello");
    begin(&self->m);
    if (fault("SHARED_START")) self->m.x[0] += 1e-9 * shared++;
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean stop_defined, fmi2Real stop)
{
    SELF;
    (void)defined, (void)tolerance;
    ALLOW(INSTANTIATED, "ANY_STATE");
    self->m.time = self->m.start = start;
    if (stop_defined) self->m.stop = stop;
    return fmi2OK;
}

static fmi2Status go(Instance *self, int from, int to, const char *unless)
{
    ALLOW(from, unless);
    self->m.state = to;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    SELF;
    if (fault("EARLY_DROPPED")) self->m.k = 2.0;
    if (fault("EARLY_INPUT_DROPPED")) self->m.u = 0.5;
    return go(self, INSTANTIATED, INITIALIZATION, "INITIALIZE_TWICE");
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    SELF;
    return go(self, INITIALIZATION, self->exchange ? EVENT : STEP, "EXIT_SOON");
}

EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c) { return go((Instance *)c, CONTINUOUS, EVENT, "-"); }
EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return go((Instance *)c, EVENT, CONTINUOUS, "-"); }

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    SELF;
    if (self->m.state == TERMINATED) return fault("TERMINATE_TWICE") ? fmi2OK : fail(self, "it has ended");
    return go(self, EVENT | CONTINUOUS | STEP, TERMINATED, "TERMINATE_SOON");
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    SELF;
    double time = self->m.time;
    DEMAND(!fault("RESET_REFUSED"), "no reset today");
    begin(&self->m);
    if (fault("RESET_MODE")) self->m.mode = 2;
    if (fault("RESET_TIME")) self->m.x[1] += 1e-6 * time;
    return fmi2OK;
}

/* --------------------------------------------------------------------------------------------------------- values */

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    SELF;
    Memory *m = &self->m;
    for (size_t i = 0; i < n; i++) {
        DEMAND(vr[i] < N_REALS || fault("ANY_REFERENCE"), "no Real has this value reference");
        DEMAND(!(fault("REFUSE") && vr[i] == Y), "y is not computed");
        bool hold = (fault("STALE") && m->state == INITIALIZATION) || (fault("STALE_OUTPUT") && vr[i] == Y) ||
                    (fault("STALE_RATE_VARIABLE") && vr[i] == RATE0);
        bool unset = vr[i] < N_REALS && m->kept[vr[i]] == 0.0;
        if (vr[i] >= N_REALS) continue;
        if (!hold || unset || vr[i] == U || vr[i] == K || vr[i] == F) m->kept[vr[i]] = value_of(m, vr[fault("READS_FIRST") ? 0 : i]);
        if (!(fault("UNWRITTEN") && vr[i] == RATE1)) value[i] = m->kept[vr[i]];
        if (fault("READ_DISTURBS") && vr[i] == Y && m->state == STEP) m->x[1] += 1e-3;
    }
    if (fault("OVERRUN")) value[n] = CANARY;
    if (fault("UNDERRUN")) value[-1] = CANARY;
    if (fault("CHANGES_REFERENCES") && n > 1) ((fmi2ValueReference *)vr)[0] = vr[1];
    return fmi2OK;
}

static fmi2Status put(Instance *self, fmi2ValueReference vr, double value)
{
    Memory *m = &self->m;
    int early = INSTANTIATED | INITIALIZATION;
    switch (vr) {
    case X0: ALLOW(early, "-"); m->x[0] = value; return fmi2OK;
    case X1: ALLOW(early, "-"); m->x[1] = fault("STATE_DROPPED") ? m->x[1] : value; return fmi2OK;
    case U: if (!fault("DROPPED_INPUT")) m->u = value; return fmi2OK;
    case K:
        if (!fault("DROPPED_PARAMETER")) m->k = fault("SWAPPED") ? m->k : value;
        if (fault("CROSS") || fault("SWAPPED")) m->f = value;
        return fmi2OK;
    case F:
        ALLOW(early, "SET_FIXED");
        m->f = fault("HALF_VALUE") ? (float)value : value;
        if (fault("CROSS_INPUT")) m->u = value;
        return fmi2OK;
    case SEVEN: return fault("SET_CONSTANT") ? fmi2OK : fail(self, "a constant cannot be set");
    default: return fault("ANY_REFERENCE") ? fmi2OK : fail(self, "what is calculated cannot be set");
    }
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    SELF;
    for (size_t i = 0; i < n; i++) {
        if (put(self, vr[i], value[i]) != fmi2OK) return fmi2Error;
        if (fault("SETS_FIRST")) break;
    }
    if (fault("CHANGES_VALUES") && n) ((fmi2Real *)value)[0] = 0.0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
{
    SELF;
    for (size_t i = 0; i < n; i++) {
        DEMAND(vr[i] == MODE || vr[i] == COUNT, "no Integer has this value reference");
        value[i] = vr[i] == COUNT ? self->m.count : fault("ENUM_VALUE") ? 7 : self->m.mode;
    }
    if (fault("OVERRUN_INTEGERS")) value[n] = 1 << 30;
    return fmi2OK;
}

#define REFUSED(Verb, Type, qualifier)                                                                               \
    EXPORT fmi2Status fmi2##Verb##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n,                     \
                                       qualifier fmi2##Type value[])                                                 \
    {                                                                                                                \
        (void)c, (void)vr, (void)value;                                                                              \
        return n ? fmi2Error : fmi2OK;                                                                               \
    }
REFUSED(Set, Integer, const)
REFUSED(Get, Boolean, )
REFUSED(Set, Boolean, const)
REFUSED(Get, String, )
REFUSED(Set, String, const)

/* ---------------------------------------------------------------------------------------------------------- state */

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    SELF;
    if (!*state) *state = malloc(sizeof(Memory));
    memcpy(*state, &self->m, sizeof(Memory));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    SELF;
    Memory before = self->m;
    memcpy(&self->m, state, sizeof(Memory));
    if (fault("STATE_VALUES")) self->m.x[0] = before.x[0];
    if (fault("STATE_TIME")) self->m.time = before.time;
    if (fault("STATE_COUNT")) self->m.count = before.count + 1;
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    if (!fault("DANGLING")) *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Memory) - (fault("SHORT_BLOCK") ? 64 : 0);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    memcpy(bytes, state, fault("SHORT_BLOCK") ? sizeof(Memory) : size);
    if (fault("HALF_BLOCK")) ((Memory *)(void *)bytes)->x[1] = 2.0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    SELF;
    DEMAND(fault("ANY_BLOCK") || !memcmp(bytes, GUID, sizeof GUID), "these bytes are no state of this FMU");
    *state = calloc(1, sizeof(Memory));
    memcpy(*state, bytes, size < sizeof(Memory) ? size : sizeof(Memory));
    return fmi2OK;
}

/* ---------------------------------------------------------------------------------------------------- derivatives */

static double slope(const Memory *m, fmi2ValueReference unknown, fmi2ValueReference known)
{
    double x0 = fault("DERIVATIVE_OF_START") ? 1.0 : m->x[0], x1 = fault("DERIVATIVE_OF_START") ? 2.0 : m->x[1];
    if (unknown == known) return 1.0;
    switch (unknown) {
    case Y: return known == X0 ? x1 : known == X1 ? x0 : known == U && !fault("NO_FEEDTHROUGH") ? 1.0 : 0.0;
    case RATE0: return known == X0 ? -(fault("DERIVATIVE_OF_PARAMETER") ? 2.0 : m->k) : known == U ? 1.0 : 0.0;
    case RATE1: return known == X0 ? m->f : known == X1 ? (fault("SIGN") ? 1.0 : -1.0) : 0.0;
    default: return 0.0;
    }
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t m,
                                               const fmi2ValueReference known[], size_t n, const fmi2Real dv[],
                                               fmi2Real du[])
{
    SELF;
    DEMAND(!fault("DIRECTIONAL_REFUSED"), "no derivatives today");
    for (size_t i = 0; i < m; i++) {
        if (fault("DIRECTIONAL_UNWRITTEN") && i == m - 1) continue;
        du[i] = 0.0;
        for (size_t j = 0; j < (fault("FIRST_KNOWN") && n ? 1 : n); j++) du[i] += slope(&self->m, unknown[i], known[j]) * dv[j];
        if (fault("WRONG_DERIVATIVE")) du[i] += 1.0;
    }
    if (fault("OVERRUN_DIRECTIONAL")) du[m] = CANARY;
    return fmi2OK;
}

/* ------------------------------------------------------------------------------------------------- model exchange */

EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    SELF;
    if (!fault("TIME_DROPPED")) self->m.time = time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *end)
{
    SELF;
    (void)no_set;
    if (fault("STEP_MOVES")) self->m.x[1] *= 1.0 + 1e-9;
    *event = (self->m.x[0] > 0.5 ? 1 : 2) != self->m.mode;
    *end = fmi2False;
    return fmi2OK;
}

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    SELF;
    Memory *m = &self->m;
    ALLOW(EVENT, "EVENTS_SOON");
    int mode = m->x[0] > 0.5 ? 1 : 2;
    bool later = m->time > m->start;
    memset(info, 0, sizeof *info);
    info->newDiscreteStatesNeeded = fault("EVENT_LOOP") || (mode != m->mode && later) || (fault("LATE_LOOP") && later);
    m->count += mode != m->mode;
    m->mode = mode;
    info->valuesOfContinuousStatesChanged = fault("VALUES_CHANGED") || (fault("VALUES_CHANGED_LATER") && later);
    info->nextEventTimeDefined = fault("PAST_EVENT") || (fault("PAST_EVENT_LATER") && later);
    info->nextEventTime = m->start - (fault("PAST_EVENT") ? 1.0 : 0.0);
    if (fault("SILENT_CHANGE") || (fault("SILENT_CHANGE_LATER") && later)) m->x[1] += 0.125;
    return fmi2OK;
}

static fmi2Status vector(Instance *self, double out[], size_t n, const double values[], const char *swapped,
                         const char *overrun)
{
    DEMAND(n == 2 || fault("ANY_LENGTH"), "the vector has another length");
    for (size_t i = 0; i < (n < 2 ? n : 2); i++) out[i] = values[fault(swapped) ? 1 - i : i];
    if (fault(overrun)) out[n] = CANARY;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real out[], size_t n)
{
    SELF;
    return vector(self, out, n, self->m.x, "STATES_ORDER", "OVERRUN_STATES");
}

EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real in[], size_t n)
{
    SELF;
    DEMAND(n == 2 || fault("ANY_LENGTH"), "the vector has another length");
    for (size_t i = 0; i < 2; i++) self->m.x[i] = in[fault("STATES_ORDER") || fault("SET_ORDER") ? 1 - i : i];
    if (fault("STATES_LIMITED")) self->m.x[0] = fmin(self->m.x[0], 1.0);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real out[], size_t n)
{
    SELF;
    Memory *m = &self->m, hidden = *m;
    double dx[2];
    bool later = m->time > m->start;
    rates(m, dx);
    if (fault("STALE_RATES") && m->stale) dx[0] = m->kept[RATE0], dx[1] = m->kept[RATE1];
    m->kept[RATE0] = dx[0], m->kept[RATE1] = dx[1], m->stale = true;
    if (!fault("STALE_RATES")) *m = hidden;
    if (fault("OTHER_RATES") || (fault("OTHER_RATES_LATER") && later)) dx[1] *= 1.01;
    if (fault("ONE_RATE")) dx[1] = dx[0];
    if (fault("UNWRITTEN_RATES")) n = 1;
    return fault("UNWRITTEN_RATES") ? (out[0] = dx[0], fmi2OK) : vector(self, out, n, dx, "ORDER", "OVERRUN_RATES");
}

EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real out[], size_t n)
{
    double nominals[] = {1.0, fault("NOMINAL") ? 0.0 : fault("NEGATIVE_NOMINAL") ? -1.0 : 1.0};
    return vector((Instance *)c, out, n, nominals, "-", "OVERRUN_NOMINALS");
}

EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real out[], size_t n)
{
    SELF;
    DEMAND(n == 1, "there is one indicator");
    if (!fault("UNWRITTEN_INDICATOR")) out[0] = fault("INDICATOR_NAN") ? NAN : self->m.x[0] - 0.5;
    if (fault("OVERRUN_INDICATORS")) out[1] = CANARY;
    return fmi2OK;
}

/* -------------------------------------------------------------------------------------------------- co-simulation */

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_set)
{
    SELF;
    Memory *m = &self->m;
    (void)no_set;
    ALLOW(STEP, "STEP_SOON");
    DEMAND(h != 0.0 || fault("STEP_ZERO"), "a step has a length");
    DEMAND(h >= 0.0 || fault("STEP_BACK"), "a step goes on");
    DEMAND(time + h <= m->stop + 1e-9 || fault("STEP_PAST"), "the step goes past the stop time");
    DEMAND(!fault("STEP_REFUSED") || m->time < m->start + 0.5, "enough");
    double length = fault("FIXED_STEP") ? 0.125 : h;
    for (int i = 0; i < 8; i++) {
        double dx[2], other = fault("SHARED_STATE") ? (shared += h) : fault("RANDOM") ? 1e-9 * rand() : 0.0;
        rates(m, dx);
        m->x[0] += length / 8 * dx[0] + other;
        m->x[1] += length / 8 * dx[1];
        int mode = m->x[0] > 0.5 ? 1 : 2;
        m->count += mode != m->mode;
        m->mode = mode;
    }
    m->time = (fault("OWN_TIME") ? m->time : time) + (fault("OWN_TIME") || fault("FIXED_STEP") ? 0.125 : h);
    if (fault("FIXED_CLOCK")) m->time = m->start + 0.125 * round((m->time - m->start) / 0.125 / 8.0);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                              const fmi2Integer order[], const fmi2Real value[])
{
    (void)c, (void)vr, (void)order, (void)value;
    return n && fault("INPUT_DERIVATIVES") ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                               const fmi2Integer order[], fmi2Real value[])
{
    SELF;
    const Memory *m = &self->m;
    double dx[2];
    rates(m, dx);
    for (size_t i = 0; i < n; i++) {
        DEMAND(order[i] == 1 && (vr[i] == X0 || vr[i] == X1 || vr[i] == Y), "only first derivatives of outputs");
        value[i] = vr[i] == Y ? dx[0] * m->x[1] + m->x[0] * dx[1] : dx[vr[i] - X0];
        if (fault("OUTPUT_NAN")) value[i] = NAN;
    }
    if (fault("OVERRUN_OUTPUTS")) value[n] = CANARY;
    return fmi2OK;
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

#define STATUS(Name, Type)                                                                                           \
    EXPORT fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind kind, Type *value)                          \
    {                                                                                                                \
        (void)c, (void)kind, (void)value;                                                                            \
        return fmi2Discard;                                                                                          \
    }
STATUS(Status, fmi2Status)
STATUS(RealStatus, fmi2Real)
STATUS(IntegerStatus, fmi2Integer)
STATUS(BooleanStatus, fmi2Boolean)
STATUS(StringStatus, fmi2String)
