/* Instances that move over events, and are saved and restored on the way. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "host3.h"

enum { STEPS = 100 };
static const double STEP = 0.02; /* s */

static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    Unit *unit = environment;
    (void)status;
    snprintf(unit->text, sizeof unit->text, "%s: %s", category, message);
}

/* Reads the first state. */
static void update(fmi3InstanceEnvironment environment, double time, fmi3Boolean sets, fmi3Boolean gets,
                   fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *early, double *early_time) {
    Unit *unit = environment;
    double values[MOST_ELEMENTS];
    const fmi3ValueReference state = 1;
    (void)early;
    (void)early_time;
    expect(time >= 0.0 && !sets && gets && finished && may_return, "another intermediate update");
    expect(fmi3GetFloat64(unit->instance, &state, 1, values, (size_t)PORTS[state].count) == fmi3OK, "%s", unit->text);
    unit->updates++;
}

/* Event iteration, to the mode in which time goes on. */
static void settle(Unit *unit) {
    fmi3Boolean again = true, terminate, nominals, states, timed;
    double next;
    while (again) {
        expect(fmi3UpdateDiscreteStates(unit->instance, &again, &terminate, &nominals, &states, &timed, &next) ==
                   fmi3OK && !terminate, "%s", unit->text);
    }
    expect((unit->co_simulation ? fmi3EnterStepMode(unit->instance) : fmi3EnterContinuousTimeMode(unit->instance)) ==
               fmi3OK, "%s", unit->text);
}

static void initialize(Unit *unit) {
    expect(fmi3EnterInitializationMode(unit->instance, true, 1e-9, 0.0, false, 0.0) == fmi3OK &&
               fmi3ExitInitializationMode(unit->instance) == fmi3OK, "%s", unit->text);
    settle(unit);
}

static void instantiate(Unit *unit, int co_simulation, int variant) {
    const fmi3ValueReference state = 1;
    *unit = (Unit){.co_simulation = co_simulation, .variant = variant};
    unit->instance = co_simulation ? fmi3InstantiateCoSimulation("it", MODEL_GUID, NULL, false, true, true, true,
                                                                 &state, 1, unit, hear, update)
                                   : fmi3InstantiateModelExchange("it", MODEL_GUID, NULL, false, true, unit, hear);
    expect(unit->instance != NULL, "%s", unit->text);
}

void start(Unit *unit, int co_simulation, int variant) {
    instantiate(unit, co_simulation, variant);
    initialize(unit);
}

static void set_inputs(Unit *unit, double time) {
    double values[MOST_ELEMENTS];
    for (fmi3ValueReference i = 0; i < N_PORTS; i++) {
        const int count = letter_of(&PORTS[i]) == 'u' ? PORTS[i].count : 0;
        for (int k = 0; k < count; k++) {
            values[k] = 0.1 * unit->variant + 0.1 * sin(3.0 * time + k);
        }
        expect(count == 0 || fmi3SetFloat64(unit->instance, &i, 1, values, (size_t)count) == fmi3OK, "%s", unit->text);
    }
}

/* The importer's solver is an explicit step of first order, which sees no events. */
static void exchange(Unit *unit, double from, double to) {
    double states[MOST_ELEMENTS], derivatives[MOST_ELEMENTS];
    size_t n;
    expect(fmi3GetNumberOfContinuousStates(unit->instance, &n) == fmi3OK || n <= MOST_ELEMENTS, "%s", unit->text);
    expect(fmi3GetContinuousStates(unit->instance, states, n) == fmi3OK &&
               fmi3GetContinuousStateDerivatives(unit->instance, derivatives, n) == fmi3OK, "%s", unit->text);
    for (size_t i = 0; i < n; i++) {
        states[i] += (to - from) * derivatives[i];
    }
    expect(fmi3SetTime(unit->instance, to) == fmi3OK &&
               fmi3SetContinuousStates(unit->instance, states, n) == fmi3OK, "%s", unit->text);
    expect(fmi3EnterEventMode(unit->instance) == fmi3OK, "%s", unit->text);
    settle(unit);
}

void advance(Unit *unit, double from, double to, void (*told)(Unit *unit)) {
    fmi3Boolean event, terminate, early = true;
    set_inputs(unit, from);
    if (!unit->co_simulation) {
        exchange(unit, from, to);
        return;
    }
    for (double time = from; early; from = time) {
        expect(fmi3DoStep(unit->instance, time, to - time, true, &event, &terminate, &early, &time) == fmi3OK &&
                   !terminate, "%s", unit->text);
        if (event && told != NULL) {
            told(unit);
        }
        if (event) {
            expect(fmi3EnterEventMode(unit->instance) == fmi3OK, "%s", unit->text);
            settle(unit);
        }
    }
}

size_t bytes_of(Unit *unit, fmi3Byte bytes[]) {
    fmi3FMUState state = NULL;
    size_t size = 0;
    expect(fmi3GetFMUState(unit->instance, &state) == fmi3OK &&
               fmi3SerializedFMUStateSize(unit->instance, state, &size) == fmi3OK && size <= MAX_BYTES &&
               fmi3SerializeFMUState(unit->instance, state, bytes, size) == fmi3OK &&
               fmi3FreeFMUState(unit->instance, &state) == fmi3OK, "%s", unit->text);
    return size;
}

static void restore(Unit *unit, const fmi3Byte bytes[], size_t size) {
    fmi3FMUState state = NULL;
    expect(fmi3DeserializeFMUState(unit->instance, bytes, size, &state) == fmi3OK &&
               fmi3SetFMUState(unit->instance, state) == fmi3OK &&
               fmi3FreeFMUState(unit->instance, &state) == fmi3OK, "%s", unit->text);
}

void cycles(int count) {
    static fmi3Byte bytes[MAX_BYTES];
    Unit unit;
    for (int i = 0; i < count; i++) {
        start(&unit, i % 2, i % 5);
        const size_t size = bytes_of(&unit, bytes);
        advance(&unit, 0.0, 0.5, NULL);
        restore(&unit, bytes, size);
        advance(&unit, 0.0, 0.5, NULL);
        expect(fmi3Reset(unit.instance) == fmi3OK, "%s", unit.text);
        initialize(&unit);
        fmi3FreeInstance(unit.instance);
    }
    printf("%d cycles\n", count);
}

/* A line: the states, a number for each element. */
static void print_states(Unit *unit) {
    double values[MOST_ELEMENTS];
    for (fmi3ValueReference i = 0; i < N_PORTS; i++) {
        const int count = letter_of(&PORTS[i]) == 'x' ? PORTS[i].count : 0;
        expect(count == 0 || fmi3GetFloat64(unit->instance, &i, 1, values, (size_t)count) == fmi3OK, "%s", unit->text);
        for (int k = 0; k < count; k++) {
            printf("%a ", values[k]);
        }
    }
    printf("\n");
}

/* The derivatives, and adjoint derivatives of the first one, of model exchange. */
static void print_derivatives(void) {
    Unit unit;
    double derivatives[MOST_ELEMENTS], values[MOST_ELEMENTS] = {0.0}, seed[MOST_ELEMENTS] = {1.0};
    const fmi3ValueReference known = 1, unknown = pick(&(Session){.random = 1}, 'c');
    size_t n;
    start(&unit, 0, 1);
    expect(fmi3GetNumberOfContinuousStates(unit.instance, &n) == fmi3OK &&
               fmi3GetContinuousStateDerivatives(unit.instance, derivatives, n) == fmi3OK, "%s", unit.text);
    expect(fmi3GetAdjointDerivative(unit.instance, &unknown, 1, &known, 1, seed, (size_t)PORTS[unknown].count, values,
                                    (size_t)PORTS[known].count) == fmi3OK, "%s", unit.text);
    for (size_t i = 0; i < n; i++) {
        printf("%a ", derivatives[i]);
    }
    printf("%a\n", values[0]);
    fmi3FreeInstance(unit.instance);
}

static void steps(Unit *unit, int first) {
    for (int i = first; i < STEPS; i++) {
        advance(unit, STEP * i, STEP * (i + 1), print_states);
        print_states(unit);
    }
}

void move(void) {
    Unit unit;
    start(&unit, 1, 0);
    steps(&unit, 0);
    expect(unit.updates > 0, "there was no intermediate update");
    fmi3FreeInstance(unit.instance);
    print_derivatives();
}

void save(const char *path) {
    static fmi3Byte bytes[MAX_BYTES];
    Unit unit;
    start(&unit, 1, 0);
    for (int i = 0; i < STEPS / 2; i++) {
        advance(&unit, STEP * i, STEP * (i + 1), NULL);
    }
    const size_t size = bytes_of(&unit, bytes);
    FILE *file = fopen(path, "wb");
    expect(file != NULL && fwrite(bytes, 1, size, file) == size && fclose(file) == 0, "%s cannot be written", path);
    fmi3FreeInstance(unit.instance);
}

void go_on(const char *path) {
    static fmi3Byte bytes[MAX_BYTES];
    Unit unit;
    instantiate(&unit, 1, 0);
    FILE *file = fopen(path, "rb");
    expect(file != NULL, "%s cannot be opened", path);
    const size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    restore(&unit, bytes, size);
    steps(&unit, STEPS / 2);
    fmi3FreeInstance(unit.instance);
}
