/* Random sequences of legal and illegal calls: after each one the status must be one that the standard's tables and the
   arguments allow, and every refusal must come with a sentence. Now and then a twin made from the serialized state goes
   on beside the instance: the two must stay equal bit for bit. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "session.h"

#define ROW(name, model_exchange, co_simulation) {#name, try_##name, {model_exchange, co_simulation}},
static const struct {
    const char *name;
    Outcome (*call)(Session *s);
    const char *legal[2]; /* by fmi2Type */
} CALLS[] = {STANDARD_CALLS(ROW)};
enum { N_CALLS = sizeof CALLS / sizeof CALLS[0], TWIN_CALLS = 30 };

static const char *const STATES[2] = {MODEL_EXCHANGE_STATES, CO_SIMULATION_STATES};
static int met[2][N_CALLS][16][2]; /* calls made: by type, function, state, accepted or not */

/* xorshift64* (Vigna 2016). */
static uint64_t next(Session *s) {
    s->random ^= s->random >> 12;
    s->random ^= s->random << 25;
    s->random ^= s->random >> 27;
    return s->random * 0x2545f4914f6cdd1du;
}

unsigned below(Session *s, unsigned n) { return (unsigned)((next(s) >> 33) % n); }
double between(Session *s, double low, double high) { return low + (high - low) * (double)(next(s) >> 11) * 0x1p-53; }
double not_finite(Session *s) { return ((const double[]){NAN, INFINITY, -INFINITY})[below(s, 3)]; }
unsigned mistake(Session *s, unsigned kinds) { return below(s, 25) == 0 ? below(s, kinds) : kinds; }
unsigned calculation(const Session *s) { return s->model.wild ? OK | DISCARDED | REFUSED : OK; }

const Variable *pick(Session *s, const char *kinds) {
    const Variable *found[MAX_VARIABLES];
    unsigned count = 0;
    for (int i = 0; i < s->fmu->variables; i++) {
        if (strchr(kinds, s->fmu->variable[i].kind) != NULL) {
            found[count++] = &s->fmu->variable[i];
        }
    }
    expect(count > 0, "there is no variable of any kind in \"%s\"", kinds);
    return found[below(s, count)];
}

/* The call that leads on from the state with this letter. */
static Outcome (*lead(Session *s, char letter))(Session *) {
    switch (letter) {
    case 'i': return try_EnterInitializationMode;
    case 'z': return try_ExitInitializationMode;
    case 'e': return try_EnterContinuousTimeMode;
    case 'c': return try_SetTime;
    case 's': return try_DoStep;
    default: return s->slot != NULL && below(s, 2) ? try_SetFMUstate : try_Reset;
    }
}

static size_t row_of(Outcome (*call)(Session *)) {
    size_t row = 0;
    while (CALLS[row].call != call) {
        row++;
    }
    return row;
}

/* Is there no state, or none serialized, for this call? */
static int lacks(const Session *s, Outcome (*call)(Session *)) {
    const int needs_slot = call == try_SetFMUstate || call == try_SerializedFMUstateSize || call == try_SerializeFMUstate;
    return (needs_slot && s->slot == NULL) || (call == try_DeSerializeFMUstate && s->size == 0);
}

/* Which call comes next: any, but mostly a legal one, often one that leads on, seldom one that ends a run. */
static size_t choose(Session *s, size_t state) {
    if (below(s, 5) == 0) {
        return row_of(lead(s, s->model.mode));
    }
    for (;;) {
        const size_t i = below(s, N_CALLS);
        const int ends = CALLS[i].call == try_Reset || CALLS[i].call == try_Terminate;
        const int wrong = CALLS[i].legal[s->type][state] == '.' || lacks(s, CALLS[i].call);
        if (wrong ? below(s, 30) == 0 : !ends || below(s, 10) == 0) {
            return i;
        }
    }
}

/* One call and its judgement; returns its status. */
static fmi2Status step(Session *s) {
    const char letter = s->model.mode;
    const size_t state = (size_t)(strchr(STATES[s->type], letter) - STATES[s->type]), i = choose(s, state);
    const fmi2Component component = s->component;
    const Model model = s->model;
    if (below(s, 200) == 0) {
        s->component = NULL;
    }
    s->log.count = 0;
    const Outcome made = CALLS[i].call(s);
    const int legal = CALLS[i].legal[s->type][state] != '.' && s->component != NULL;
    const unsigned allowed = legal ? made.allowed : REFUSED;
    expect((1u << made.status & allowed) != 0, "fmi2%s in state %c of type %d: status %d, allowed is the set %u; %s",
           CALLS[i].name, letter, (int)s->type, (int)made.status, allowed, s->log.text);
    if (s->component == NULL) { /* without an instance nothing happens */
        s->component = component;
        s->model = model;
        return made.status;
    }
    met[s->type][i][state][made.status == fmi2Error]++;
    if (made.status == fmi2Error) {
        s->model = model;
        s->model.mode = 'x';
    }
    const int said = made.status == fmi2Error || CALLS[i].call == try_DoStep || s->logging;
    const int due = made.status != fmi2OK && said && !s->silent;
    const int noticed = made.status == fmi2OK && s->log.count > 0 && s->log.status == fmi2Warning;
    expect(s->log.count == due || noticed, "fmi2%s: status %d with %d messages", CALLS[i].name, (int)made.status, s->log.count);
    expect(!due || (s->log.status == made.status && strncmp(s->log.text, "fmi2", 4) == 0 && strlen(s->log.text) > 30),
           "fmi2%s: status %d with status %d, \"%s\"", CALLS[i].name, (int)made.status, (int)s->log.status, s->log.text);
    return made.status;
}

/* Goes on beside an instance that was made from its serialized state. */
static void twin_steps(Session *s) {
    static Session twin;
    static fmi2Byte one[MAX_BYTES], other[MAX_BYTES];
    const fmi2CallbackFunctions callbacks = callbacks_to(&twin.log);
    fmi2FMUstate state = NULL;
    if (s->slot != NULL) {
        expect(s->fmu->FreeFMUstate(s->component, &s->slot) == fmi2OK, "a state cannot be freed");
    }
    expect(s->fmu->SetDebugLogging(s->component, fmi2True, 0, NULL) == fmi2OK, "logging cannot be set");
    s->logging = 1;
    memcpy(&twin, s, sizeof twin);
    twin.silent = 0;
    twin.component = s->fmu->Instantiate("twin", s->type, s->fmu->guid, NULL, &callbacks, fmi2False, fmi2True);
    size_t size = serialize(s->fmu, s->component, one);
    expect(s->fmu->DeSerializeFMUstate(twin.component, one, size, &state) == fmi2OK, "%s", twin.log.text);
    expect(s->fmu->SetFMUstate(twin.component, state) == fmi2OK, "%s", twin.log.text);
    expect(s->fmu->FreeFMUstate(twin.component, &state) == fmi2OK, "%s", twin.log.text);
    for (int i = 0; i < TWIN_CALLS; i++) {
        const fmi2Status status = step(s);
        expect(step(&twin) == status, "a restored instance answers differently: %s", twin.log.text);
        size = serialize(s->fmu, s->component, one);
        expect(serialize(s->fmu, twin.component, other) == size && memcmp(one, other, size) == 0,
               "a restored instance moves differently");
    }
    if (twin.slot != NULL) {
        s->fmu->FreeFMUstate(twin.component, &twin.slot);
    }
    s->fmu->FreeInstance(twin.component);
}

/* A new instance in place of the one before, after some that cannot be made; a few have no logger. */
static void begin(Session *s) {
    fmi2CallbackFunctions callbacks = callbacks_to(&s->log);
    const fmi2CallbackFunctions logged = callbacks;
    const Fmu *fmu = s->fmu;
    s->silent = below(s, 4) == 0;
    callbacks.logger = s->silent ? NULL : callbacks.logger;
    expect(fmu->Instantiate("", s->type, fmu->guid, NULL, &logged, 0, 1) == NULL && s->log.count == 1, "no name");
    expect(fmu->Instantiate(NULL, s->type, fmu->guid, NULL, &logged, 0, 0) == NULL && s->log.count == 2, "no name");
    expect(fmu->Instantiate("it", s->type, "{wrong}", NULL, &logged, 0, 0) == NULL && s->log.count == 3, "GUID");
    expect(fmu->Instantiate("it", s->type, NULL, NULL, &callbacks, 0, 0) == NULL, "no GUID");
    expect(fmu->Instantiate("it", s->type, fmu->guid, NULL, NULL, 0, 0) == NULL, "no callbacks");
    s->component = fmu->Instantiate("it", s->type, fmu->guid, "file:///nowhere", &callbacks, fmi2False, fmi2True);
    expect(s->component != NULL, "%s", s->log.text);
    s->logging = 1;
    s->slot = NULL;
    s->size = 0;
    s->model = (Model){'i', 0, 0.0, INFINITY};
}

static void end(Session *s) {
    if (s->slot != NULL) {
        expect(s->fmu->FreeFMUstate(s->component, &s->slot) == fmi2OK, "a state cannot be freed");
    }
    s->fmu->FreeInstance(s->component);
}

/* How often each function was accepted and refused in each state, a line for each function. */
static void report(fmi2Type type) {
    for (size_t i = 0; i < N_CALLS; i++) {
        printf("%s %s", type == fmi2ModelExchange ? "ModelExchange" : "CoSimulation", CALLS[i].name);
        for (size_t state = 0; state < strlen(STATES[type]); state++) {
            printf(" %c%c:%d/%d", STATES[type][state], CALLS[i].legal[type][state], met[type][i][state][0],
                   met[type][i][state][1]);
        }
        printf("\n");
    }
}

void random_calls(const Fmu *fmu, int count, uint64_t seed) {
    static Session s;
    for (int type = 0; type < 2; type++) {
        Log log;
        s.fmu = fmu;
        s.type = (fmi2Type)type;
        s.random = 0x9e3779b97f4a7c15u * (seed + 1);
        fmi2Component fresh = instantiate(fmu, s.type, &log);
        serialize(fmu, fresh, s.fresh);
        fmu->FreeInstance(fresh);
        fmi2Component foreign = instantiate(fmu, (fmi2Type)(1 - type), &log);
        s.foreign_size = serialize(fmu, foreign, s.foreign);
        fmu->FreeInstance(foreign);
        begin(&s);
        for (int i = 0; i < count; i++) {
            step(&s);
            if (below(&s, 300) == 0) {
                twin_steps(&s);
            }
            if (below(&s, 1000) == 0) {
                end(&s);
                begin(&s);
            }
        }
        end(&s);
        report(s.type);
    }
}
