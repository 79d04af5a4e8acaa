/* An FMU of FMI 3.0, for model exchange and co-simulation, that is right, or wrong in the way that FAULT in the
   environment says:  dx0/dt = u - k x0,  dx1/dt = f x0 - x1,  y = x0 x1 + u,  an event where x0 falls below 1/2. */
#include "fmi3Functions.h"
#include <math.h>
#include <fenv.h>
#include <locale.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __unix__
#include <unistd.h>
#endif

#define TOKEN "{a7b1c4de-0123-4567-89ab-cdef01234567}"
#define EXPORT __attribute__((visibility("default")))

enum { INSTANTIATED = 1, INITIALIZATION = 2, EVENT = 4, CONTINUOUS = 8, STEP = 16, TERMINATED = 32, ANY = 63 };
enum { TIME, X, RATE, U, K, F, Y, Z, MODE, COUNT, SEVEN, TICK, N_REFERENCES };

typedef struct {
    char token[sizeof TOKEN];
    double time, start, stop, x[2], u, k, f, kept[N_REFERENCES][2];
    int64_t mode;
    int32_t count;
    int state;
    bool ticks, stale;
} Memory;

typedef struct {
    Memory m;
    bool exchange, events, early, logging, off;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    fmi3IntermediateUpdateCallback update;
} Instance;

#define CANARY 1e300
static double shared;

static bool fault(const char *name)
{
    const char *wanted = getenv("FAULT");
    return wanted && !strcmp(wanted, name);
}

static fmi3Status fail(Instance *self, const char *sentence)
{
    bool speaks = !fault("SILENT_ERROR") && !(fault("SILENT_WHEN_OFF") && !self->logging);
    if (self->log && speaks) {
        self->log(fault("LOG_ENVIRONMENT") ? NULL : self->environment, fmi3Error,
                  fault("CATEGORY") ? "chatter" : "logStatusError", fault("LINE_BREAK") ? "no\n" : sentence);
    }
    return fmi3Error;
}

#define SELF Instance *self = (Instance *)instance
#define DEMAND(condition, sentence) do { if (!(condition)) return fail(self, sentence); } while (0)
#define ALLOW(states) DEMAND((self->m.state & (states)) || fault("ANY_STATE"), "a call that is not legal in this state")

static void begin(Instance *self)
{
    Memory *m = &self->m;
    double x = m->x[0], time = m->time;
    memset(m, 0, sizeof *m);
    memcpy(m->token, TOKEN, sizeof TOKEN);
    m->x[0] = fault("HALF_RESET") && x != 0.0 ? x : 1.0;
    m->x[1] = fault("RESET_TIME") ? 2.0 + 1e-6 * time : 2.0;
    m->u = 0.5;
    m->k = fault("OTHER_START") ? 2.5 : 2.0;
    m->f = fault("ROUNDED_START") ? 3.0000000001 : 3.0;
    m->mode = fault("RESET_MODE_VALUE") && x != 0.0 ? 2 : 1;
    m->stop = INFINITY;
    m->state = INSTANTIATED;
}

static void rates(const Memory *m, double dx[2])
{
    dx[0] = (fault("IGNORED_INPUT") ? 0.5 : m->u) - (fault("IGNORED_PARAMETER") ? 2.0 : m->k) * m->x[0];
    dx[1] = (fault("IGNORED_FIXED") ? 3.0 : m->f) * m->x[0] - m->x[1];
    if (fault("RATE_NAN")) dx[1] = NAN;
}

/* ------------------------------------------------------------------------------------------------------ instances */

static fmi3Instance make(fmi3String name, fmi3String token, fmi3Boolean logging, fmi3InstanceEnvironment environment,
                         fmi3LogMessageCallback log)
{
    if (fault("CHDIR") && chdir("/")) return NULL;
    if (fault("LOCALE")) setlocale(LC_NUMERIC, strcmp(setlocale(LC_NUMERIC, NULL), "C") ? "C" : "C.UTF-8");
    fesetround(fault("ROUNDING") ? FE_TOWARDZERO : FE_TONEAREST);
    Instance *self = calloc(1, sizeof *self);
    self->environment = environment;
    self->log = log;
    self->logging = logging;
    begin(self);
    if (fault("SHARED_START")) self->m.x[0] += 1e-9 * shared++;
    if (((!name || !*name) && !fault("NO_NAME")) || (!token && !fault("NO_TOKEN")) || fault("NO_INSTANCE") ||
        (token && strcmp(token, TOKEN) && !fault("ANY_TOKEN"))) {
        fail(self, "there is no licence");
        free(self);
        return NULL;
    }
    return self;
}

EXPORT const char *fmi3GetVersion(void) { return fault("VERSION") ? "3.1" : "3.0"; }

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                                 fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                                 fmi3LogMessageCallback log)
{
    (void)path, (void)visible;
    Instance *self = fault("NO_EXCHANGE") ? NULL : make(name, token, logging, environment, log);
    if (self) self->exchange = true;
    return self;
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                                fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                                const fmi3ValueReference required[], size_t n,
                                                fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                fmi3IntermediateUpdateCallback update)
{
    (void)path, (void)visible, (void)required, (void)n;
    Instance *self = make(name, token, logging, environment, log);
    if (self) self->events = events, self->early = early, self->update = update;
    return self;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String path,
                                                      fmi3Boolean visible, fmi3Boolean logging,
                                                      fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                      fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
                                                      fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)token, (void)path, (void)visible, (void)logging, (void)environment, (void)log, (void)clock;
    (void)lock, (void)unlock;
    return NULL;
}

EXPORT void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t n, const fmi3String names[])
{
    SELF;
    (void)n, (void)names;
    self->off = !on;
    return fmi3OK;
}

static fmi3Status go(Instance *self, int from, int to)
{
    ALLOW(from);
    self->m.state = to;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean defined, fmi3Float64 tolerance,
                                              fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    SELF;
    (void)defined, (void)tolerance;
    if (self->off && self->log && fault("CHATTER")) self->log(self->environment, fmi3OK, "logStatusError", "hello");
    self->m.time = self->m.start = start;
    self->m.stop = stop_defined ? stop : INFINITY;
    if (fault("EARLY_DROPPED")) self->m.k = 2.0;
    if (fault("EARLY_INPUT_DROPPED")) self->m.u = 0.5;
    return go(self, INSTANTIATED, INITIALIZATION);
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    SELF;
    return go(self, INITIALIZATION, self->exchange || self->events ? EVENT : STEP);
}

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    SELF;
    DEMAND(self->exchange || self->events || fault("EVENTS_ANYWAY"), "there is no Event Mode");
    return go(self, CONTINUOUS | STEP, EVENT);
}

EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    SELF;
    DEMAND(self->exchange, "this is no model exchange");
    return go(self, EVENT, CONTINUOUS);
}

EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    SELF;
    DEMAND(!self->exchange || fault("ANY_KIND"), "this is no co-simulation");
    return go(self, EVENT, STEP);
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance instance)
{
    SELF;
    if (fault("FORGETS")) self->m.x[0] = 0.0;
    return go(self, EVENT | CONTINUOUS | STEP, TERMINATED);
}

EXPORT fmi3Status fmi3Reset(fmi3Instance instance)
{
    SELF;
    DEMAND(!fault("RESET_REFUSED"), "no reset today");
    DEMAND(!(fault("RESET_MODE") && self->m.state == EVENT), "no reset in Event Mode");
    begin(self);
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    SELF;
    return fault("CONFIGURE") ? fmi3OK : fail(self, "there are no structural parameters");
}

EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    SELF;
    return fault("CONFIGURE") ? fmi3OK : fail(self, "there are no structural parameters");
}

/* --------------------------------------------------------------------------------------------------------- values */

static size_t size_of(fmi3ValueReference vr) { return vr == X || vr == RATE ? 2 : 1; }

static void value_of(const Instance *self, fmi3ValueReference vr, double out[])
{
    const Memory *m = &self->m;
    double dx[2];
    rates(m, dx);
    switch (vr) {
    case TIME: out[0] = fault("TIME_STANDS") ? m->start : m->time; break;
    case X: out[0] = m->x[0], out[1] = m->x[1]; break;
    case RATE: out[0] = dx[0], out[1] = dx[1]; break;
    case U: out[0] = m->u; break;
    case K: out[0] = m->k; break;
    case F: out[0] = m->f; break;
    case Y: out[0] = fault("NOT_A_NUMBER") || (fault("LATE_NAN") && m->time > m->start + 0.5) ? NAN : m->x[0] * m->x[1] + (fault("IGNORED_INPUT") ? 0.5 : m->u); break;
    case Z: out[0] = m->x[0] - 0.5; break;
    case SEVEN: out[0] = 7.0; break;
    }
    if (fault("LATE_STARTS") && m->state == INSTANTIATED) out[0] = 0.0;
}

static bool is_float(fmi3ValueReference vr)
{
    return vr < N_REFERENCES && ((vr != MODE && vr != COUNT && vr != TICK) || fault("ANY_TYPE"));
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[],
                                 size_t count)
{
    SELF;
    size_t done = 0;
    DEMAND(n > 0 || !fault("NOTHING"), "nothing is asked for");
    for (size_t i = 0; i < n; i++) {
        double found[2];
        if (fault("ANY_REFERENCE") && !is_float(vr[i])) return fmi3OK;
        if (fault("CRASH") && !is_float(vr[i])) abort();
        DEMAND(is_float(vr[i]), "no Float64 has this value reference");
        if (fault("REFUSE") && vr[i] == Y) return fail(self, "y is not computed");
        value_of(self, vr[fault("READS_FIRST") ? 0 : i], found);
        bool hold = (fault("STALE") && self->m.state == INITIALIZATION && vr[i] != U && vr[i] != K && vr[i] != F) ||
                    (fault("STALE_OUTPUT") && vr[i] == Y) || (fault("STALE_RATE_VARIABLE") && vr[i] == RATE);
        if (!hold || self->m.kept[vr[i]][0] == 0.0) memcpy(self->m.kept[vr[i]], found, sizeof found);
        if (hold) memcpy(found, self->m.kept[vr[i]], sizeof found);
        if (fault("READ_DISTURBS") && vr[i] == Y && self->m.state == STEP) self->m.x[1] += 1e-3;
        if (fault("UNWRITTEN") && vr[i] == Z) done++;
        else for (size_t j = 0; j < size_of(vr[i]); j++, done++) {
            if (done < count) value[done] = found[j];
        }
    }
    DEMAND(done == count || fault("ANY_COUNT"), "the number of values is not that of the elements");
    if (fault("OVERRUN")) value[count] = CANARY;
    if (fault("UNDERRUN")) value[-1] = CANARY;
    if (fault("CHANGES_REFERENCES") && n > 1) ((fmi3ValueReference *)vr)[0] = vr[1];
    return fmi3OK;
}

static fmi3Status put(Instance *self, fmi3ValueReference vr, const double in[])
{
    Memory *m = &self->m;
    int early = INSTANTIATED | INITIALIZATION;
    DEMAND(vr < N_REFERENCES || fault("ANY_REFERENCE"), "no variable has this value reference");
    switch (vr) {
    case X: ALLOW(early | CONTINUOUS | (self->exchange ? EVENT : 0)); m->x[0] = in[0], m->x[1] = fault("STATE_DROPPED") ? m->x[1] : in[1]; break;
    case U:
        ALLOW(early | EVENT | CONTINUOUS | STEP);
        if (!fault("HALF_SET")) m->u = in[0];
        break;
    case K:
        ALLOW(early | EVENT | STEP);
        m->k = fault("DROPPED_PARAMETER") || fault("SWAPPED") ? m->k : in[0];
        if (fault("CROSS") || fault("SWAPPED")) m->f = in[0];
        break;
    case F:
        DEMAND((m->state & early) || fault("SET_FIXED") || fault("ANY_STATE"), "a fixed parameter");
        m->f = fault("HALF_VALUE") ? (float)in[0] : in[0];
        if (fault("CROSS_INPUT")) m->u = in[0];
        break;
    case TIME: DEMAND(fault("SET_TIME"), "the independent variable cannot be set"); break;
    case SEVEN: DEMAND(fault("SET_CONSTANT"), "a constant cannot be set"); break;
    default: DEMAND(fault("SET_OUTPUT") || fault("ANY_REFERENCE"), "what is calculated cannot be set");
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                 const fmi3Float64 value[], size_t count)
{
    SELF;
    size_t done = 0;
    for (size_t i = 0; i < n; i++) done += size_of(vr[i]);
    DEMAND(done == count || fault("ANY_COUNT"), "the number of values is not that of the elements");
    if (done != count) return fmi3OK;
    done = 0;
    for (size_t i = 0; i < n; done += size_of(vr[i]), i++) {
        if (put(self, vr[i], value + done) != fmi3OK) return fmi3Error;
        if (fault("SETS_FIRST")) break;
    }
    if (fault("CHANGES_VALUES") && count) ((fmi3Float64 *)value)[0] = 0.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Int64 value[],
                               size_t count)
{
    SELF;
    for (size_t i = 0; i < n; i++) {
        DEMAND(vr[i] == MODE && count == n, "no Int64 has this value reference");
        value[i] = fault("ENUM_VALUE") ? 7 : self->m.mode;
    }
    if (fault("OVERRUN_INTEGERS")) value[n] = 1 << 30;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Int32 value[],
                               size_t count)
{
    SELF;
    for (size_t i = 0; i < n; i++) {
        DEMAND((vr[i] == COUNT && count == n) || fault("ANY_TYPE"), "no Int32 has this value reference");
        value[i] = self->m.count;
    }
    if (fault("OVERRUN_COUNTS")) value[n] = 1 << 30;
    return fmi3OK;
}

#define NONE(verb, Type, qualifier)                                                                              \
    EXPORT fmi3Status fmi3##verb##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,           \
                                       qualifier fmi3##Type value[], size_t count)                               \
    {                                                                                                            \
        SELF;                                                                                                    \
        (void)vr, (void)value, (void)count;                                                                      \
        return n && !fault("ANY_REFERENCE") ? fail(self, "there is no variable of this type") : fmi3OK;          \
    }
#define NEITHER(Type) NONE(Get, Type, ) NONE(Set, Type, const)
NEITHER(Float32)
NEITHER(Int8)
NEITHER(UInt8)
NEITHER(Int16)
NEITHER(UInt16)
NEITHER(UInt32)
NEITHER(UInt64)
NEITHER(Boolean)
NEITHER(String)
NONE(Set, Int32, const)
NONE(Set, Int64, const)

/* Functions that this FMU only refuses, unless FAULT says otherwise. */
#define REFUSED(Name, allowed, ...)                                                                              \
    EXPORT fmi3Status fmi3##Name(fmi3Instance instance, __VA_ARGS__)                                             \
    {                                                                                                            \
        SELF;                                                                                                    \
        return fault(allowed) ? fmi3OK : fail(self, "there is nothing of this kind");                            \
    }
#define V const fmi3ValueReference vr[], size_t n
REFUSED(GetBinary, "-", V, size_t sizes[], fmi3Binary value[], size_t count)
REFUSED(SetBinary, "-", V, const size_t sizes[], const fmi3Binary value[], size_t count)
REFUSED(SetClock, "SET_CLOCK", V, const fmi3Clock value[])
REFUSED(GetIntervalDecimal, "INTERVAL", V, fmi3Float64 a[], fmi3IntervalQualifier b[])
REFUSED(GetIntervalFraction, "-", V, fmi3UInt64 a[], fmi3UInt64 b[], fmi3IntervalQualifier c[])
REFUSED(GetShiftDecimal, "-", V, fmi3Float64 a[])
REFUSED(GetShiftFraction, "-", V, fmi3UInt64 a[], fmi3UInt64 b[])
REFUSED(SetIntervalDecimal, "-", V, const fmi3Float64 a[])
REFUSED(SetIntervalFraction, "-", V, const fmi3UInt64 a[], const fmi3UInt64 b[])
REFUSED(SetShiftDecimal, "-", V, const fmi3Float64 a[])
REFUSED(SetShiftFraction, "-", V, const fmi3UInt64 a[], const fmi3UInt64 b[])
REFUSED(ActivateModelPartition, "PARTITION", fmi3ValueReference clock, fmi3Float64 time)

EXPORT fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3Clock value[])
{
    SELF;
    ALLOW(EVENT | INITIALIZATION);
    for (size_t i = 0; i < n; i++) {
        DEMAND(vr[i] == TICK || fault("ANY_REFERENCE"), "no clock has this value reference");
        value[i] = self->m.ticks;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    SELF;
    return fault("EVALUATE") ? fmi3OK : fail(self, "discrete states are not evaluated alone");
}

/* ---------------------------------------------------------------------------------------------------------- state */

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    SELF;
    if (!*state) *state = malloc(sizeof(Memory));
    memcpy(*state, &self->m, sizeof(Memory));
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    SELF;
    Memory before = self->m;
    memcpy(&self->m, state, sizeof(Memory));
    if (fault("STATE_MODE")) self->m.state = before.state;
    if (fault("STATE_VALUES")) self->m.x[0] = before.x[0];
    if (fault("STATE_TIME")) self->m.time = before.time;
    if (fault("STATE_COUNT")) self->m.count = before.count + 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    free(*state);
    if (!fault("DANGLING")) *state = NULL;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    (void)instance, (void)state;
    *size = sizeof(Memory) - (fault("SHORT_BLOCK") ? 64 : 0);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    (void)instance;
    memcpy(bytes, state, fault("SHORT_BLOCK") ? sizeof(Memory) : size);
    if (fault("HALF_BLOCK")) ((Memory *)(void *)bytes)->x[1] = 2.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                          fmi3FMUState *state)
{
    SELF;
    bool own = size == sizeof(Memory) && !memcmp(bytes, TOKEN, sizeof TOKEN);
    DEMAND(own || fault("ANY_BLOCK"), "these bytes are no state of this FMU");
    *state = calloc(1, sizeof(Memory));
    memcpy(*state, bytes, size < sizeof(Memory) ? size : sizeof(Memory));
    return fmi3OK;
}

/* ---------------------------------------------------------------------------------------------------- derivatives */

/* Columns of the Jacobian: time, x0, x1, u, k, f. */
static size_t columns(fmi3ValueReference vr, size_t out[2])
{
    static const size_t FIRST[] = {[TIME] = 0, [X] = 1, [U] = 3, [K] = 4, [F] = 5};
    bool known = vr == TIME || vr == X || vr == U || vr == K || vr == F;
    if (known) out[0] = FIRST[vr], out[1] = 2;
    return known ? size_of(vr) : 0;
}

/* The row of element e of an unknown; false if it is none. */
static bool row(const Instance *self, fmi3ValueReference vr, size_t e, double out[6])
{
    const Memory *m = &self->m;
    memset(out, 0, 6 * sizeof *out);
    switch (vr) {
    case X: out[1 + e] = 1.0; return true;
    case Z: out[1] = 1.0; return true;
    case Y: out[1] = m->x[1], out[2] = fault("DERIVATIVE_OF_START") ? 1.0 : m->x[0];
        out[3] = fault("NO_FEEDTHROUGH") ? 0.0 : 1.0;
        break;
    case RATE:
        if (e == 0) out[1] = fault("DERIVATIVE_OF_PARAMETER") ? -2.0 : -m->k, out[3] = 1.0, out[4] = fault("NO_PARAMETERS") ? 0.0 : -m->x[0];
        else out[1] = m->f, out[2] = fault("SIGN") ? 1.0 : -1.0, out[5] = fault("NO_PARAMETERS") || fault("NO_FIXED") ? 0.0 : m->x[0];
        break;
    default: return false;
    }
    if (fault("WRONG_DERIVATIVE")) out[1] += 1.0;
    return true;
}

/* Directional (seed by known) or adjoint (seed by unknown) derivatives. */
static fmi3Status product(Instance *self, bool adjoint, const fmi3ValueReference unknown[], size_t m,
                          const fmi3ValueReference known[], size_t n, const double seed[], size_t n_seed,
                          double out[], size_t n_out)
{
    size_t all_unknown = 0, all_known = 0, r = 0;
    ALLOW(INITIALIZATION | EVENT | CONTINUOUS | STEP | TERMINATED);
    DEMAND(!fault(adjoint ? "ADJOINT_REFUSED" : "DIRECTIONAL_REFUSED"), "no derivatives today");
    for (size_t i = 0; i < m; i++) {
        double values[6];
        if (fault("ANY_UNKNOWN") && unknown[i] >= N_REFERENCES) return fmi3OK;
        DEMAND(unknown[i] < N_REFERENCES && row(self, unknown[i], 0, values), "no unknown");
        all_unknown += size_of(unknown[i]);
    }
    for (size_t i = 0; i < n; i++) {
        size_t at[2];
        DEMAND(columns(known[i], at) > 0, "no known");
        all_known += size_of(known[i]);
    }
    size_t in = adjoint ? all_unknown : all_known, result = adjoint ? all_known : all_unknown;
    DEMAND((n_seed == in && n_out == result) || fault("ANY_SIZE"), "the sizes are not those of the elements");
    if (n_seed != in || n_out != result) return fmi3OK;
    double unwritten = n_out ? out[n_out - 1] : 0.0;
    memset(out, 0, n_out * sizeof *out);
    if (fault(adjoint ? "OVERRUN_ADJOINT" : "OVERRUN_DIRECTIONAL")) out[n_out] = CANARY;
    for (size_t i = 0; i < m; i++) {
        for (size_t e = 0; e < size_of(unknown[i]); e++, r++) {
            double values[6];
            size_t c = 0;
            row(self, unknown[i], e, values);
            if (fault("DIRECTIONAL_UNWRITTEN") && !adjoint && r + 1 == n_out) out[r] = unwritten;
            for (size_t j = 0; j < n; j++) {
                size_t at[2], width = columns(known[j], at);
                if (fault("FIRST_KNOWN") && j > 0) break;
                for (size_t k = 0; k < width; k++, c++) {
                    double slope = values[k == 0 ? at[0] : at[1]];
                    if (adjoint) out[c] += slope * seed[r] * (fault("WRONG_ADJOINT") ? 2.0 : 1.0);
                    else if (!(fault("DIRECTIONAL_UNWRITTEN") && r + 1 == n_out)) out[r] += slope * seed[c];
                }
            }
        }
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknown[], size_t m,
                                               const fmi3ValueReference known[], size_t n, const fmi3Float64 seed[],
                                               size_t n_seed, fmi3Float64 out[], size_t n_out)
{
    SELF;
    return product(self, false, unknown, m, known, n, seed, n_seed, out, n_out);
}

EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknown[], size_t m,
                                           const fmi3ValueReference known[], size_t n, const fmi3Float64 seed[],
                                           size_t n_seed, fmi3Float64 out[], size_t n_out)
{
    SELF;
    return product(self, true, unknown, m, known, n, seed, n_seed, out, n_out);
}

typedef struct { fmi3ValueReference of; size_t element; fmi3ValueReference known; size_t known_element; } Row;
static const Row ROWS[] = {{X, 1, X, 1}, {X, 2, X, 2}, {Y, 0, X, 0}, {Y, 0, U, 0}, {RATE, 1, X, 1}, {RATE, 1, U, 0},
                           {RATE, 1, K, 0}, {RATE, 2, X, 0}, {RATE, 2, F, 0}, {MODE, 0, X, 1}};

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference vr, size_t *n)
{
    SELF;
    *n = 0;
    DEMAND(vr < N_REFERENCES || fault("ANY_REFERENCE"), "no variable has this value reference");
    for (size_t i = 0; i < sizeof ROWS / sizeof *ROWS; i++) *n += ROWS[i].of == vr;
    if (fault("DEPENDENCIES") && vr == Y) *n = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference vr, size_t element[],
                                              fmi3ValueReference known[], size_t known_element[],
                                              fmi3DependencyKind kind[], size_t n)
{
    (void)instance;
    for (size_t i = 0, done = 0; i < sizeof ROWS / sizeof *ROWS && done < n; i++) {
        if (ROWS[i].of != vr) continue;
        element[done] = fault("ELEMENTS") ? 5 : ROWS[i].element;
        known[done] = ROWS[i].known;
        known_element[done] = ROWS[i].known_element;
        kind[done++] = fmi3Dependent;
    }
    return fmi3OK;
}

/* --------------------------------------------------------------------------------------------------------- events */

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *end,
                                           fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *defined,
                                           fmi3Float64 *next)
{
    SELF;
    Memory *m = &self->m;
    ALLOW(EVENT);
    int64_t mode = m->x[0] > 0.5 ? 1 : 2;
    *again = fault("EVENT_LOOP") || (mode != m->mode && m->time > m->start);
    m->ticks = *again || fault("CLOCK_STAYS");
    m->count += mode != m->mode;
    m->mode = mode;
    *end = *nominals = false;
    *values = fault("VALUES_CHANGED") || (fault("VALUES_CHANGED_LATER") && m->time > m->start);
    *defined = fault("PAST_EVENT") || (fault("PAST_EVENT_LATER") && m->time > m->start + 0.125);
    *next = m->start - 1.0;
    if (fault("LATE_LOOP") && m->time > m->start + 0.25) *again = true;
    if (fault("SILENT_CHANGE") || (fault("SILENT_CHANGE_LATER") && m->time > m->start)) m->x[1] += 0.125;
    if (fault("OTHER_EVENT") && !self->exchange && *again) m->x[1] += 0.125;
    return fmi3OK;
}

/* ------------------------------------------------------------------------------------------------- model exchange */

EXPORT fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    SELF;
    DEMAND(self->exchange || fault("ANY_KIND"), "this is no model exchange");
    ALLOW(CONTINUOUS | STEP);
    if (!fault("TIME_DROPPED")) self->m.time = time;
    return fmi3OK;
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_set, fmi3Boolean *event,
                                              fmi3Boolean *end)
{
    SELF;
    (void)no_set;
    ALLOW(CONTINUOUS);
    if (fault("STEP_MOVES")) self->m.x[1] *= 1.0 + 1e-9;
    *event = (self->m.x[0] > 0.5 ? 1 : 2) != self->m.mode;
    *end = false;
    return fmi3OK;
}

static fmi3Status vector(Instance *self, double out[], size_t n, size_t own, const double values[], const char *what)
{
    char unwritten[32], overrun[32], swapped[32];
    snprintf(unwritten, sizeof unwritten, "UNWRITTEN_%s", what);
    snprintf(overrun, sizeof overrun, "OVERRUN_%s", what);
    snprintf(swapped, sizeof swapped, "%s_ORDER", what);
    DEMAND(self->exchange || fault("ANY_KIND"), "this is no model exchange");
    DEMAND(n == own || fault("ANY_LENGTH"), "the vector has another length");
    for (size_t i = 0; i < (n < own ? n : own); i++) {
        if (!(fault(unwritten) && i + 1 == own)) out[i] = values[fault("ORDER") || fault(swapped) ? own - 1 - i : i];
    }
    if (fault("OVERRUN_VECTORS") || fault(overrun)) out[n] = CANARY;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 out[], size_t n)
{
    SELF;
    return vector(self, out, n, 2, self->m.x, "STATES");
}

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 in[], size_t n)
{
    SELF;
    DEMAND(n == 2 || fault("ANY_LENGTH"), "the vector has another length");
    ALLOW(CONTINUOUS);
    for (size_t i = 0; i < 2; i++) self->m.x[fault("ORDER") || fault("STATES_ORDER") || fault("SET_ORDER") ? 1 - i : i] = in[i];
    if (fault("STATES_LIMITED")) self->m.x[0] = fmin(self->m.x[0], 1.0);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 out[], size_t n)
{
    SELF;
    double dx[2];
    rates(&self->m, dx);
    if (fault("STALE_RATES") && self->m.stale) memcpy(dx, self->m.kept[RATE], sizeof dx);
    if (fault("STALE_RATES")) memcpy(self->m.kept[RATE], dx, sizeof dx);
    self->m.stale = fault("STALE_RATES");
    if (fault("OTHER_RATES")) dx[1] *= 1.01;
    if (fault("ONE_RATE")) dx[1] = dx[0];
    if (fault("RATES_LATER") && self->m.time > self->m.start) dx[1] *= 1.01;
    return vector(self, out, n, 2, dx, "RATES");
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 out[], size_t n)
{
    SELF;
    double nominals[] = {1.0, fault("NOMINAL") ? 0.0 : fault("NEGATIVE_NOMINAL") ? -1.0 : 1.0};
    return vector(self, out, n, 2, nominals, "NOMINALS");
}

EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 out[], size_t n)
{
    SELF;
    double z = fault("INDICATOR_NAN") ? NAN : self->m.x[0] - (fault("INDICATOR") ? 0.25 : 0.5);
    return vector(self, out, n, 1, &z, "INDICATORS");
}

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *n)
{
    (void)instance;
    *n = fault("STATES_BY_REFERENCE") ? 1 : 2;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *n)
{
    (void)instance;
    *n = fault("NO_INDICATORS") ? 0 : 1;
    return fmi3OK;
}

/* -------------------------------------------------------------------------------------------------- co-simulation */

/* Whether the importer asks to return early. */
static bool updated(Instance *self)
{
    fmi3Boolean asked = false;
    fmi3Float64 until = self->m.time;
    bool offers = self->early || fault("UPDATE_OFFERS");
    if (!self->update || fault("NO_UPDATE")) return false;
    self->update(fault("UPDATE_ENVIRONMENT") ? NULL : self->environment,
                 fault("UPDATE_TIME") ? self->m.start - 1.0 : self->m.time, false, true, true, offers, &asked, &until);
    return asked && self->early && !fault("GOES_ON");
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 h, fmi3Boolean no_set,
                             fmi3Boolean *event, fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached)
{
    SELF;
    Memory *m = &self->m;
    (void)no_set;
    DEMAND(!self->exchange || fault("ANY_KIND"), "this is no co-simulation");
    ALLOW(STEP);
    DEMAND(h > 0.0 || fault("STEP_LENGTH"), "a step has a length");
    DEMAND(fabs(time - m->time) < 1e-9 || fault("STEP_ELSEWHERE") || fault("OWN_TIME") || fault("FIXED_CLOCK") || h <= 0.0, "the step begins elsewhere");
    DEMAND(time + h <= m->stop + 1e-9 || fault("STEP_PAST"), "the step goes past the stop time");
    DEMAND(!fault("STEP_REFUSED") || m->time < m->start + 0.5, "enough");
    *event = *end = *early = false;
    double length = fault("FIXED_STEP") ? 0.125 : h;
    for (int i = 1; i <= 8 && !*early; i++) {
        double dx[2], size = fault("SHARED_STATE") ? (shared += h) : fault("RANDOM") ? 1e-9 * rand() : 0.0;
        rates(m, dx);
        m->x[0] += length / 8 * dx[0] + size;
        m->x[1] += length / 8 * dx[1];
        m->time = i == 8 ? time + h : time + i * h / 8;
        if (fault("OWN_TIME")) m->time = time + 0.125 * i / 8;
        if (fault("FIXED_CLOCK")) m->time = m->start + 0.125 * round((time + h - m->start) / 0.125 / 8.0);
        bool asked = updated(self), crossed = (m->x[0] > 0.5 ? 1 : 2) != m->mode;
        if (crossed && !self->events) m->mode = 3 - m->mode, m->count++;
        *event = (crossed && self->events) || fault("EVENT_ANYWAY");
        *early = i < 8 && (asked || (*event && self->early) || (fault("EARLY_ANYWAY") && crossed));
    }
    *reached = fault("LAST_TIME") ? time - h : m->time;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                           const fmi3Int32 order[], fmi3Float64 value[], size_t count)
{
    SELF;
    const Memory *m = &self->m;
    double dx[2];
    size_t done = 0;
    ALLOW(STEP | EVENT | TERMINATED);
    for (size_t i = 0; i < n; i++) done += size_of(vr[i]);
    DEMAND(done == count, "the number of values is not that of the elements");
    done = 0;
    rates(m, dx);
    for (size_t i = 0; i < n; i++) {
        DEMAND(order[i] == 1 || fault("ANY_ORDER"), "only first derivatives are known");
        DEMAND(vr[i] == X || vr[i] == Y, "no continuous output has this value reference");
        if (vr[i] == X) value[done++] = fault("OUTPUT_RATE") ? 0.0 : dx[0], value[done++] = dx[1];
        else value[done++] = fault("OUTPUT_NAN") ? NAN : dx[0] * m->x[1] + m->x[0] * dx[1];
    }
    if (fault("OVERRUN_OUTPUTS")) value[done] = CANARY;
    return fmi3OK;
}
