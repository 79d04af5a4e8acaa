/* Each call with right arguments, and now and then with wrong ones. */
#include <math.h>
#include <string.h>

#include "random_calls3.h"

/* The statuses of a calculation with right arguments; after an error the values may be anything. */
static unsigned calculation(const Session *s) {
    return s->model.wild || s->model.mode == 'x' ? OK | DISCARDED | REFUSED : OK;
}

static Outcome transition(Session *s, fmi3Status status, char mode, unsigned allowed) {
    if (status == fmi3OK) {
        s->model.mode = mode;
    }
    return (Outcome){status, allowed};
}

Outcome try_SetDebugLogging(Session *s) {
    const fmi3String right[] = {"logAll"}, wrong[] = {"logNothing"};
    if (mistake(s)) {
        return (Outcome){fmi3SetDebugLogging(s->instance, true, 1, NULL), REFUSED};
    }
    const int unknown = mistake(s);
    return (Outcome){fmi3SetDebugLogging(s->instance, true, 1, unknown ? wrong : right), unknown ? WARNED : OK};
}

Outcome try_EnterInitializationMode(Session *s) {
    if (mistake(s)) {
        return (Outcome){fmi3EnterInitializationMode(s->instance, true, -1.0, 0.0, false, 0.0), REFUSED};
    }
    s->model.time = between(s, 0.0, 1.0);
    return transition(s, fmi3EnterInitializationMode(s->instance, true, 1e-6, s->model.time, false, 0.0), 'z', OK);
}

Outcome try_ExitInitializationMode(Session *s) {
    const char next = !s->co_simulation || s->events ? 'e' : 's';
    return transition(s, fmi3ExitInitializationMode(s->instance), next, calculation(s));
}

Outcome try_EnterEventMode(Session *s) {
    const unsigned allowed = !s->co_simulation || s->events ? calculation(s) : REFUSED;
    return transition(s, fmi3EnterEventMode(s->instance), 'e', allowed);
}

Outcome try_Terminate(Session *s) { return transition(s, fmi3Terminate(s->instance), 't', OK); }

Outcome try_Reset(Session *s) {
    const Outcome made = transition(s, fmi3Reset(s->instance), 'i', OK);
    if (made.status == fmi3OK) {
        s->model = (Model){'i', 0, 0.0};
    }
    return made;
}

static Outcome read_port(Session *s, fmi3ValueReference reference) {
    static double values[MOST_ELEMENTS];
    const size_t count = reference < N_PORTS ? (size_t)PORTS[reference].count : 1;
    const int wrong = mistake(s), none = reference >= N_PORTS;
    const fmi3Status status = fmi3GetFloat64(s->instance, &reference, 1, values, count + (size_t)wrong);
    return (Outcome){status, wrong || none ? REFUSED : calculation(s)};
}

Outcome try_GetFloat64(Session *s) {
    if (mistake(s)) {
        return (Outcome){fmi3GetFloat64(s->instance, NULL, 1, NULL, 1), REFUSED};
    }
    return read_port(s, pick(s, "xupfc"[below(s, 5)]));
}

Outcome try_GetInt32(Session *s) {
    const fmi3ValueReference reference = pick(s, mistake(s) ? 'x' : 'i');
    const int right = reference < N_PORTS && VARIABLES[PORTS[reference].first].kind == VARIABLE_IMPACTS;
    fmi3Int32 value;
    return (Outcome){fmi3GetInt32(s->instance, &reference, 1, &value, 1), right ? calculation(s) : REFUSED};
}

Outcome try_GetInt64(Session *s) {
    const fmi3ValueReference reference = pick(s, 'm');
    fmi3Int64 value;
    return (Outcome){fmi3GetInt64(s->instance, &reference, 1, &value, 1),
                     reference < N_PORTS ? calculation(s) : REFUSED};
}

Outcome try_GetClock(Session *s) {
    const fmi3ValueReference reference = pick(s, 'k');
    fmi3Clock value;
    return (Outcome){fmi3GetClock(s->instance, &reference, 1, &value), reference < N_PORTS ? OK : REFUSED};
}

Outcome try_GetOther(Session *s) {
    const size_t count = below(s, 2);
    const fmi3ValueReference reference = 1;
    const unsigned allowed = count == 0 ? OK : REFUSED;
    union {
        fmi3Float32 real;
        fmi3Int8 number;
        fmi3UInt64 large;
        fmi3Boolean flag;
        fmi3String text;
        fmi3Binary bytes;
    } value;
    size_t size;
    switch (below(s, 6)) {
    case 0: return (Outcome){fmi3GetFloat32(s->instance, &reference, count, &value.real, count), allowed};
    case 1: return (Outcome){fmi3GetInt8(s->instance, &reference, count, &value.number, count), allowed};
    case 2: return (Outcome){fmi3GetUInt64(s->instance, &reference, count, &value.large, count), allowed};
    case 3: return (Outcome){fmi3GetBoolean(s->instance, &reference, count, &value.flag, count), allowed};
    case 4: return (Outcome){fmi3GetString(s->instance, &reference, count, &value.text, count), allowed};
    default: return (Outcome){fmi3GetBinary(s->instance, &reference, count, &size, &value.bytes, count), allowed};
    }
}

/* Sets all elements of a port to what they are, moved by no more than this part. */
static Outcome move_port(Session *s, char kind, double part, int wild) {
    static double values[MOST_ELEMENTS];
    const fmi3ValueReference reference = pick(s, kind);
    const size_t count = reference < N_PORTS ? (size_t)PORTS[reference].count : 1;
    const int right = reference < N_PORTS, strange = mistake(s);
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = right ? &VARIABLES[PORTS[reference].first + (int)i] : VARIABLES;
        const double start = kind == 'x' || kind == 'c' ? START_STATES[variable->index % N_STATES]
                             : kind == 'u'              ? 0.0
                             : kind == 'p'              ? START_PARAMETERS[variable->index]
                                                        : 0.0;
        values[i] = strange ? NAN : start + part * between(s, -1.0, 1.0) * (start != 0.0 && kind == 'p' ? start : 1.0);
    }
    const fmi3Status status = fmi3SetFloat64(s->instance, &reference, 1, values, count);
    s->model.wild = s->model.wild || (wild && status == fmi3OK);
    return (Outcome){status, !right || strange || kind == 'c' ? REFUSED : OK | DISCARDED};
}

Outcome try_SetFloat64_input(Session *s) { return move_port(s, 'u', 1.0, 0); }
Outcome try_SetFloat64_state(Session *s) { return move_port(s, 'x', 0.01, 1); }
Outcome try_SetFloat64_tunable(Session *s) { return move_port(s, 'p', 0.01, 1); }
Outcome try_SetFloat64_calculated(Session *s) { return move_port(s, 'c', 0.01, 1); }

Outcome try_SetFloat64_fixed(Session *s) {
    const fmi3ValueReference reference = pick(s, 'f');
    const double value = below(s, 2) ? 0.0 : -1.0; /* -1: below the minimum of settings */
    const fmi3Status status = fmi3SetFloat64(s->instance, &reference, 1, &value, 1);
    s->model.wild = s->model.wild || status == fmi3OK;
    return (Outcome){status, reference >= N_PORTS ? REFUSED : OK | DISCARDED};
}

Outcome try_SetInt32(Session *s) {
    const fmi3ValueReference reference = pick(s, 'i');
    const size_t count = below(s, 2);
    const fmi3Int32 value = 1;
    return (Outcome){fmi3SetInt32(s->instance, &reference, count, &value, count), count == 0 ? OK : REFUSED};
}

Outcome try_SetInt64(Session *s) {
    const fmi3ValueReference reference = pick(s, 'm');
    const size_t count = below(s, 2);
    const fmi3Int64 value = 1;
    return (Outcome){fmi3SetInt64(s->instance, &reference, count, &value, count), count == 0 ? OK : REFUSED};
}

Outcome try_SetOther(Session *s) {
    const size_t count = below(s, 2);
    const fmi3ValueReference reference = 1;
    const fmi3UInt8 value = 1;
    return (Outcome){fmi3SetUInt8(s->instance, &reference, count, &value, count), count == 0 ? OK : REFUSED};
}

Outcome try_SetClock(Session *s) {
    const fmi3ValueReference reference = pick(s, 'k');
    const size_t count = below(s, 2);
    const fmi3Clock value = fmi3ClockActive;
    return (Outcome){fmi3SetClock(s->instance, &reference, count, &value), count == 0 ? OK : REFUSED};
}

Outcome try_GetFMUState(Session *s) {
    if (mistake(s)) {
        return (Outcome){fmi3GetFMUState(s->instance, NULL), REFUSED};
    }
    const Model model = s->model;
    const fmi3Status status = fmi3GetFMUState(s->instance, &s->slot);
    s->slot_model = status == fmi3OK ? model : s->slot_model;
    return (Outcome){status, calculation(s)};
}

Outcome try_SetFMUState(Session *s) {
    const fmi3Status status = fmi3SetFMUState(s->instance, s->slot);
    if (status == fmi3OK) {
        s->model = s->slot_model;
    }
    return (Outcome){status, s->slot == NULL ? REFUSED : OK};
}

Outcome try_FreeFMUState(Session *s) { return (Outcome){fmi3FreeFMUState(s->instance, &s->slot), OK}; }

Outcome try_SerializedFMUStateSize(Session *s) {
    size_t size;
    return (Outcome){fmi3SerializedFMUStateSize(s->instance, s->slot, &size), s->slot == NULL ? REFUSED : OK};
}

Outcome try_SerializeFMUState(Session *s) {
    size_t size = 0;
    if (s->slot == NULL || s->instance == NULL ||
        fmi3SerializedFMUStateSize(s->instance, s->slot, &size) != fmi3OK) {
        return (Outcome){fmi3SerializeFMUState(s->instance, NULL, s->bytes, 1), REFUSED};
    }
    expect(size <= MAX_BYTES, "a state has %u bytes", (unsigned)size);
    const int wrong = mistake(s);
    const fmi3Status status = fmi3SerializeFMUState(s->instance, s->slot, s->bytes, size - (size_t)wrong);
    if (status == fmi3OK) {
        s->size = size;
        s->bytes_model = s->slot_model;
    }
    return (Outcome){status, wrong ? REFUSED : OK};
}

Outcome try_DeserializeFMUState(Session *s) {
    fmi3FMUState state = NULL;
    if (s->size == 0) {
        return (Outcome){fmi3DeserializeFMUState(s->instance, s->bytes, 0, &state), REFUSED};
    }
    const size_t place = below(s, (unsigned)s->size);
    const int damaged = mistake(s);
    s->bytes[place] ^= (fmi3Byte)damaged;
    const fmi3Status status = fmi3DeserializeFMUState(s->instance, s->bytes, s->size, &state);
    s->bytes[place] ^= (fmi3Byte)damaged;
    if (status == fmi3OK) {
        expect(fmi3FreeFMUState(s->instance, &state) == fmi3OK && state == NULL, "%s", s->text);
    }
    return (Outcome){status, damaged ? REFUSED : OK};
}

Outcome try_GetDirectionalDerivative(Session *s) {
    static double seed[MOST_ELEMENTS], result[MOST_ELEMENTS];
    const fmi3ValueReference known = pick(s, "xup"[below(s, 3)]), unknown = pick(s, 'c');
    const int right = known < N_PORTS && unknown < N_PORTS, wrong = mistake(s);
    const size_t n = right ? (size_t)PORTS[known].count : 1, m = right ? (size_t)PORTS[unknown].count : 1;
    for (size_t i = 0; i < n; i++) {
        seed[i] = between(s, -1.0, 1.0);
    }
    const fmi3Status status =
        fmi3GetDirectionalDerivative(s->instance, &unknown, 1, &known, 1, seed, n + (size_t)wrong, result, m);
    return (Outcome){status, right && !wrong ? calculation(s) : REFUSED};
}

Outcome try_GetAdjointDerivative(Session *s) {
    static double seed[MOST_ELEMENTS], result[MOST_ELEMENTS];
    const fmi3ValueReference known = pick(s, "xup"[below(s, 3)]), unknown = pick(s, 'c');
    const int right = known < N_PORTS && unknown < N_PORTS, wrong = mistake(s);
    const size_t n = right ? (size_t)PORTS[known].count : 1, m = right ? (size_t)PORTS[unknown].count : 1;
    for (size_t i = 0; i < m; i++) {
        seed[i] = between(s, -1.0, 1.0);
    }
    const fmi3Status status =
        fmi3GetAdjointDerivative(s->instance, &unknown, 1, &known, 1, seed, m, result, n + (size_t)wrong);
    return (Outcome){status, right && !wrong ? calculation(s) : REFUSED};
}

Outcome try_GetNumberOfVariableDependencies(Session *s) {
    const fmi3ValueReference reference = below(s, N_PORTS + 2);
    size_t count;
    return (Outcome){fmi3GetNumberOfVariableDependencies(s->instance, reference, &count),
                     reference < N_PORTS ? OK : REFUSED};
}

Outcome try_GetVariableDependencies(Session *s) {
    static size_t elements[MOST_ELEMENTS], others[MOST_ELEMENTS];
    static fmi3ValueReference knowns[MOST_ELEMENTS];
    static fmi3DependencyKind kinds[MOST_ELEMENTS];
    const fmi3ValueReference reference = below(s, N_PORTS);
    const size_t count = (size_t)(FIRST_DEPENDENCIES[reference + 1] - FIRST_DEPENDENCIES[reference]);
    const int wrong = mistake(s);
    return (Outcome){fmi3GetVariableDependencies(s->instance, reference, elements, knowns, others, kinds,
                                                 count + (size_t)wrong), wrong ? REFUSED : OK};
}

Outcome try_EnterConfigurationMode(Session *s) { return (Outcome){fmi3EnterConfigurationMode(s->instance), OK}; }
Outcome try_ExitConfigurationMode(Session *s) { return (Outcome){fmi3ExitConfigurationMode(s->instance), OK}; }
Outcome try_EvaluateDiscreteStates(Session *s) { return (Outcome){fmi3EvaluateDiscreteStates(s->instance), OK}; }

Outcome try_ActivateModelPartition(Session *s) {
    return (Outcome){fmi3ActivateModelPartition(s->instance, 0, 0.0), OK};
}

Outcome try_GetInterval(Session *s) {
    const fmi3ValueReference reference = pick(s, 'k');
    const size_t count = below(s, 2);
    fmi3UInt64 counter, resolution;
    fmi3Float64 interval;
    fmi3IntervalQualifier qualifier;
    const unsigned allowed = count == 0 ? OK : REFUSED;
    switch (below(s, 4)) {
    case 0: return (Outcome){fmi3GetIntervalDecimal(s->instance, &reference, count, &interval, &qualifier), allowed};
    case 1:
        return (Outcome){fmi3GetIntervalFraction(s->instance, &reference, count, &counter, &resolution, &qualifier),
                         allowed};
    case 2: return (Outcome){fmi3GetShiftDecimal(s->instance, &reference, count, &interval), allowed};
    default: return (Outcome){fmi3GetShiftFraction(s->instance, &reference, count, &counter, &resolution), allowed};
    }
}

Outcome try_SetInterval(Session *s) {
    const fmi3ValueReference reference = pick(s, 'k');
    const size_t count = below(s, 2);
    const fmi3UInt64 number = 1;
    const double interval = 0.1;
    return (Outcome){below(s, 2) ? fmi3SetIntervalDecimal(s->instance, &reference, count, &interval)
                                 : fmi3SetIntervalFraction(s->instance, &reference, count, &number, &number),
                     count == 0 ? OK : REFUSED};
}

Outcome try_SetShift(Session *s) {
    const fmi3ValueReference reference = pick(s, 'k');
    const size_t count = below(s, 2);
    const fmi3UInt64 number = 1;
    const double shift = 0.1;
    return (Outcome){below(s, 2) ? fmi3SetShiftDecimal(s->instance, &reference, count, &shift)
                                 : fmi3SetShiftFraction(s->instance, &reference, count, &number, &number),
                     count == 0 ? OK : REFUSED};
}

Outcome try_UpdateDiscreteStates(Session *s) {
    fmi3Boolean more, end, nominals, values, timed;
    double next;
    const int wrong = mistake(s);
    return (Outcome){fmi3UpdateDiscreteStates(s->instance, &more, &end, &nominals, &values, &timed,
                                              wrong ? NULL : &next), wrong ? REFUSED : calculation(s)};
}

Outcome try_EnterContinuousTimeMode(Session *s) {
    return transition(s, fmi3EnterContinuousTimeMode(s->instance), 'c', OK);
}

Outcome try_CompletedIntegratorStep(Session *s) {
    fmi3Boolean event, end;
    const int wrong = mistake(s);
    return (Outcome){fmi3CompletedIntegratorStep(s->instance, true, wrong ? NULL : &event, &end),
                     wrong ? REFUSED : calculation(s)};
}

Outcome try_SetTime(Session *s) {
    const int wrong = mistake(s);
    const double time = wrong ? NAN : s->model.time + between(s, 0.0, 0.01);
    const fmi3Status status = fmi3SetTime(s->instance, time);
    s->model.time = status == fmi3OK ? time : s->model.time;
    return (Outcome){status, wrong ? REFUSED : OK};
}

Outcome try_SetContinuousStates(Session *s) {
    double x[N_CONTINUOUS];
    const int wrong = mistake(s), strange = mistake(s);
    for (int i = 0; i < N_CONTINUOUS; i++) {
        x[i] = strange ? INFINITY : START_STATES[CONTINUOUS_STATES[i]] + between(s, -0.01, 0.01);
    }
    s->model.wild = 1;
    return (Outcome){fmi3SetContinuousStates(s->instance, x, N_CONTINUOUS + (size_t)wrong),
                     wrong ? REFUSED : strange ? DISCARDED : OK};
}

#define READ_VECTOR(name, size, calculated)                                                            \
    Outcome try_##name(Session *s) {                                                                   \
        double values[(size) + 1];                                                                     \
        const int wrong = mistake(s);                                                                  \
        return (Outcome){fmi3##name(s->instance, values, (size_t)(size) + (size_t)wrong),              \
                         wrong ? REFUSED : (calculated) ? calculation(s) : OK};                        \
    }

READ_VECTOR(GetContinuousStateDerivatives, N_CONTINUOUS, 1)
READ_VECTOR(GetEventIndicators, N_EVENTS, 1)
READ_VECTOR(GetContinuousStates, N_CONTINUOUS, 1)
READ_VECTOR(GetNominalsOfContinuousStates, N_CONTINUOUS, 0)

#define READ_NUMBER(name, number)                                                                      \
    Outcome try_##name(Session *s) {                                                                   \
        size_t count = 0;                                                                              \
        const int wrong = mistake(s);                                                                  \
        const fmi3Status status = fmi3##name(s->instance, wrong ? NULL : &count);                      \
        expect(status != fmi3OK || count == (size_t)(number), "fmi3" #name ": %u", (unsigned)count);   \
        return (Outcome){status, wrong ? REFUSED : OK};                                                \
    }

READ_NUMBER(GetNumberOfEventIndicators, N_EVENTS)
READ_NUMBER(GetNumberOfContinuousStates, N_CONTINUOUS)

Outcome try_EnterStepMode(Session *s) { return transition(s, fmi3EnterStepMode(s->instance), 's', OK); }

Outcome try_GetOutputDerivatives(Session *s) {
    static double values[MOST_ELEMENTS];
    const fmi3ValueReference reference = pick(s, 'x');
    const fmi3Int32 order = (fmi3Int32)below(s, 4);
    const Variable *variable = &VARIABLES[PORTS[reference].first];
    const unsigned allowed = order >= 1 && order <= 2 && variable->output ? calculation(s) : REFUSED;
    return (Outcome){fmi3GetOutputDerivatives(s->instance, &reference, 1, &order, values,
                                              (size_t)PORTS[reference].count), allowed};
}

Outcome try_DoStep(Session *s) {
    fmi3Boolean event = false, end = false, early = false;
    double last = s->model.time;
    const double step = between(s, 0.001, 0.2);
    const int wrong = mistake(s), late = !wrong && mistake(s);
    s->erred_inside = 0;
    const fmi3Status status = fmi3DoStep(s->instance, s->model.time + (late ? 1.0 : 0.0), step, true,
                                         wrong ? NULL : &event, &end, &early, &last);
    if (status == fmi3OK) {
        expect(last >= s->model.time && last <= s->model.time + step, "the step ends at %g", last);
        expect(early == (last < s->model.time + step), "early return is not told");
        expect((s->early || !early) && ((s->early && s->events) || !event), "an early return that is not allowed");
        s->model.time = last;
    }
    return (Outcome){status, wrong || late || s->erred_inside ? REFUSED : calculation(s)};
}
