/* Random sequences of legal and illegal calls. After each one the status must be one that the
   standard's tables and the arguments allow, and every refusal must come with a sentence. Now and then a twin made from
   the serialized state goes on beside the instance: the two must stay equal bit for bit. */
#include "random_calls3.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROW(name, model_exchange, co_simulation) {#name, try_##name, {model_exchange, co_simulation}},
static const struct {
    const char *name;
    Outcome (*call)(Session *s);
    const char *legal[2]; /* model exchange, co-simulation */
} CALLS[] = {STANDARD_CALLS(ROW)};
enum { N_CALLS = sizeof CALLS / sizeof CALLS[0], TWIN_CALLS = 30 };

static const char *const STATES[2] = {MODEL_EXCHANGE_STATES, CO_SIMULATION_STATES};
static int met[2][N_CALLS][8][2]; /* calls made: by type, function, state, accepted or not */

void expect(int condition, const char *format, ...) {
    va_list arguments;
    if (condition) {
        return;
    }
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    printf("\n");
    exit(1);
}

/* xorshift64* (Vigna 2016). */
static uint64_t next(Session *s) {
    s->random ^= s->random >> 12;
    s->random ^= s->random << 25;
    s->random ^= s->random >> 27;
    return s->random * 0x2545f4914f6cdd1du;
}

unsigned below(Session *s, unsigned n) { return (unsigned)((next(s) >> 33) % n); }
double between(Session *s, double low, double high) { return low + (high - low) * (double)(next(s) >> 11) * 0x1p-53; }
int mistake(Session *s) { return below(s, 25) == 0; }

char letter_of(const Port *port) {
    switch (port->second ? VARIABLE_ACCELERATION : VARIABLES[port->first].kind) {
    case VARIABLE_STATE:           return 'x';
    case VARIABLE_INPUT:           return 'u';
    case VARIABLE_PARAMETER:       return 'p';
    case VARIABLE_FIXED_PARAMETER:
    case VARIABLE_SETTING:         return 'f';
    case VARIABLE_IMPACTS:         return 'i';
    case VARIABLE_MODE:            return 'm';
    case VARIABLE_CLOCK:           return 'k';
    case VARIABLE_ACCELERATION:
    case VARIABLE_DEPENDENT:
    case VARIABLE_LOCAL:
    case VARIABLE_FURTHER_RATE:
    case VARIABLE_MULTIPLIER:      return 'c';
    default:                       return '?';
    }
}

fmi3ValueReference pick(Session *s, char kind) {
    static fmi3ValueReference found[N_PORTS];
    unsigned count = 0;
    for (fmi3ValueReference i = 0; i < N_PORTS; i++) {
        if (letter_of(&PORTS[i]) == kind) {
            found[count++] = i;
        }
    }
    return count > 0 ? found[below(s, count)] : N_PORTS + below(s, 3);
}

/* Takes what it is told, and now and then calls the FMU, which a logger must not. */
static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    static unsigned heard; /* what is random must not depend on notes, which twins do not share */
    Session *s = environment;
    double value;
    const fmi3ValueReference time = 0;
    if (s->calling && ++heard % 50 == 0) {
        fmi3FreeInstance(s->instance);
        expect(fmi3GetFloat64(s->instance, &time, 1, &value, 1) == fmi3Error, "a call in the logger is accepted");
    }
    s->errors += status == fmi3Error;
    s->messages += status != fmi3OK;
    snprintf(s->text, sizeof s->text, "%s: %s", category, message);
    expect(strlen(message) > 20 && strncmp(message, "fmi3", 4) == 0, "a message: %s", message);
}

/* Sets all inputs to this value. */
static void set_inputs(Session *s, double value) {
    static double values[MOST_ELEMENTS];
    for (fmi3ValueReference i = 0; i < N_PORTS; i++) {
        const int count = letter_of(&PORTS[i]) == 'u' ? PORTS[i].count : 0;
        for (int k = 0; k < count; k++) {
            values[k] = value;
        }
        expect(count == 0 || fmi3SetFloat64(s->instance, &i, 1, values, (size_t)count) == fmi3OK, "%s", s->text);
    }
}

/* A call that is illegal in an intermediate update. */
static fmi3Status wrong_call(Session *s, fmi3ValueReference state) {
    static double values[MOST_ELEMENTS];
    fmi3Boolean event, terminate, early;
    double last;
    switch (below(s, 7)) {
    case 0: return fmi3Reset(s->instance);
    case 1: return fmi3SetFloat64(s->instance, &state, 1, values, (size_t)PORTS[state].count);
    case 2: return fmi3EnterEventMode(s->instance);
    case 3: return fmi3Terminate(s->instance);
    case 4: return fmi3DoStep(s->instance, s->model.time, 0.01, true, &event, &terminate, &early, &last);
    case 5: return fmi3SetFMUState(s->instance, s->slot);
    default: fmi3FreeInstance(s->instance); return fmi3Error;
    }
}

/* Reads and sets what was announced; now and then it makes wrong calls, one after the other. */
static void update(fmi3InstanceEnvironment environment, double time, fmi3Boolean sets, fmi3Boolean gets,
                   fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *early, double *early_time) {
    Session *s = environment;
    const fmi3ValueReference state = pick(s, 'x');
    static double values[MOST_ELEMENTS];
    fmi3FMUState saved = NULL;
    expect(sets != gets && gets == finished, "what may be done in an intermediate update");
    expect(may_return == (finished && s->early), "early return is offered wrongly");
    if (s->erred_inside) {
        return;
    }
    if (sets) {
        set_inputs(s, 0.1 * time);
    } else {
        expect(fmi3GetFloat64(s->instance, &state, 1, values, (size_t)PORTS[state].count) == fmi3OK, "%s", s->text);
        expect(below(s, 5) > 0 || (fmi3GetFMUState(s->instance, &saved) == fmi3OK &&
                                   fmi3FreeFMUState(s->instance, &saved) == fmi3OK), "%s", s->text);
    }
    if (below(s, 500) == 0) {
        s->erred_inside = 1;
        for (unsigned i = 0; i <= below(s, 3); i++) {
            expect(wrong_call(s, state) == fmi3Error, "accepted in an intermediate update");
        }
    } else if (may_return && below(s, 10) == 0) {
        *early = true;
        *early_time = time + between(s, 0.0, 0.01);
    }
}

/* Makes the instance of a session. */
static void make(Session *s, const char *token) {
    fmi3ValueReference announced[N_PORTS];
    size_t count = 0;
    for (fmi3ValueReference i = 0; i < N_PORTS; i++) {
        if (letter_of(&PORTS[i]) == 'u' || letter_of(&PORTS[i]) == 'x') {
            announced[count++] = i;
        }
    }
    s->instance = s->co_simulation
                      ? fmi3InstantiateCoSimulation("it", token, NULL, false, true, s->events, s->early,
                                                    s->follows ? announced : NULL, s->follows ? count : 0, s, hear,
                                                    s->follows ? update : NULL)
                      : fmi3InstantiateModelExchange("it", token, NULL, false, true, s, hear);
}

/* A new instance in place of the one before, after one that cannot be made. */
static void begin(Session *s) {
    s->events = (int)below(s, 2);
    s->early = (int)below(s, 2);
    s->follows = below(s, 3) == 0;
    s->messages = 0;
    make(s, "{wrong}");
    expect(s->instance == NULL && s->messages == 1, "a wrong token");
    make(s, MODEL_GUID);
    expect(s->instance != NULL, "%s", s->text);
    s->slot = NULL;
    s->size = 0;
    s->model = (Model){'i', 0, 0.0};
}

static void end(Session *s) {
    expect(s->slot == NULL || fmi3FreeFMUState(s->instance, &s->slot) == fmi3OK, "a state cannot be freed");
    fmi3FreeInstance(s->instance);
}

/* The call that leads on from the state with this letter. */
static Outcome (*lead(Session *s))(Session *) {
    switch (s->model.mode) {
    case 'i': return try_EnterInitializationMode;
    case 'z': return try_ExitInitializationMode;
    case 'e': return below(s, 2)          ? try_UpdateDiscreteStates
                     : s->co_simulation ? try_EnterStepMode
                                        : try_EnterContinuousTimeMode;
    case 'c': return try_SetTime;
    case 's': return try_DoStep;
    default: return s->slot != NULL && below(s, 2) ? try_SetFMUState : try_Reset;
    }
}

/* Which call comes next: any, but mostly a legal one, often one that leads on, seldom one that ends a run. */
static size_t choose(Session *s, size_t state) {
    if (below(s, 5) == 0) {
        Outcome (*const call)(Session *) = lead(s);
        size_t row = 0;
        while (CALLS[row].call != call) {
            row++;
        }
        return row;
    }
    for (;;) {
        const size_t i = below(s, N_CALLS);
        const int ends = CALLS[i].call == try_Reset || CALLS[i].call == try_Terminate;
        const int wrong = CALLS[i].legal[s->co_simulation][state] == '.';
        const int none = s->slot == NULL && (CALLS[i].call == try_SetFMUState || CALLS[i].call == try_SerializeFMUState ||
                                             CALLS[i].call == try_SerializedFMUStateSize);
        if (wrong || none ? below(s, 30) == 0 : !ends || below(s, 10) == 0) {
            return i;
        }
    }
}

/* One call and its judgement; returns its status. */
static fmi3Status step(Session *s) {
    const char *states = STATES[s->co_simulation];
    const char letter = s->model.mode;
    const size_t state = (size_t)(strchr(states, letter) - states), i = choose(s, state);
    const fmi3Instance instance = s->instance;
    const Model model = s->model;
    if (below(s, 200) == 0) {
        s->instance = NULL;
    }
    s->errors = s->messages = 0;
    s->calling = 1;
    const Outcome made = CALLS[i].call(s);
    s->calling = 0;
    const int legal = CALLS[i].legal[s->co_simulation][state] != '.' && s->instance != NULL;
    const unsigned allowed = legal ? made.allowed : REFUSED;
    expect((1u << made.status & allowed) != 0, "fmi3%s in state %c of type %d: status %d, allowed is the set %u; %s",
           CALLS[i].name, letter, s->co_simulation, (int)made.status, allowed, s->text);
    if (s->instance == NULL) { /* without an instance nothing happens */
        s->instance = instance;
        s->model = model;
        return made.status;
    }
    met[s->co_simulation][i][state][made.status == fmi3Error]++;
    expect(made.status != fmi3Error || s->errors > 0, "fmi3%s refuses without a message", CALLS[i].name);
    expect(made.status == fmi3OK || s->messages > 0, "fmi3%s: status %d without a message", CALLS[i].name,
           (int)made.status);
    if (made.status == fmi3Error) {
        s->model = model;
        s->model.mode = 'x';
    }
    return made.status;
}

/* The serialized state of the instance; returns its size. */
static size_t serialize(Session *s, fmi3Byte bytes[]) {
    fmi3FMUState state = NULL;
    size_t size = 0;
    expect(fmi3GetFMUState(s->instance, &state) == fmi3OK, "%s", s->text);
    expect(fmi3SerializedFMUStateSize(s->instance, state, &size) == fmi3OK && size <= MAX_BYTES, "%s", s->text);
    expect(fmi3SerializeFMUState(s->instance, state, bytes, size) == fmi3OK, "%s", s->text);
    expect(fmi3FreeFMUState(s->instance, &state) == fmi3OK, "%s", s->text);
    return size;
}

/* Goes on beside an instance that was made from its serialized state. */
static void twin_steps(Session *s) {
    static Session twin;
    static fmi3Byte one[MAX_BYTES], other[MAX_BYTES];
    fmi3FMUState state = NULL;
    expect(s->slot == NULL || fmi3FreeFMUState(s->instance, &s->slot) == fmi3OK, "a state cannot be freed");
    memcpy(&twin, s, sizeof twin);
    make(&twin, MODEL_GUID);
    const size_t size = serialize(s, one);
    expect(fmi3DeserializeFMUState(twin.instance, one, size, &state) == fmi3OK, "%s", twin.text);
    expect(fmi3SetFMUState(twin.instance, state) == fmi3OK, "%s", twin.text);
    expect(fmi3FreeFMUState(twin.instance, &state) == fmi3OK, "%s", twin.text);
    for (int i = 0; i < TWIN_CALLS; i++) {
        const fmi3Status status = step(s);
        expect(step(&twin) == status, "a restored instance answers differently: %s", twin.text);
        expect(serialize(s, one) == serialize(&twin, other) && memcmp(one, other, size) == 0,
               "a restored instance moves differently");
    }
    end(&twin);
}

/* How often each function was accepted and refused in each state, a line for each function. */
static void report(int co_simulation) {
    for (size_t i = 0; i < N_CALLS; i++) {
        printf("%s %s", co_simulation ? "CoSimulation" : "ModelExchange", CALLS[i].name);
        for (size_t state = 0; state < strlen(STATES[co_simulation]); state++) {
            printf(" %c%c:%d/%d", STATES[co_simulation][state], CALLS[i].legal[co_simulation][state],
                   met[co_simulation][i][state][0], met[co_simulation][i][state][1]);
        }
        printf("\n");
    }
}

void random_calls(int count, unsigned long long seed) {
    static Session s;
    for (s.co_simulation = 0; s.co_simulation < 2; s.co_simulation++) {
        s.random = 0x9e3779b97f4a7c15u * (seed + 1);
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
        report(s.co_simulation);
    }
}
