/* How an FMU moves, as text that can be compared with that of another platform: one line a point, numbers in %a. */
#include <math.h>
#include <stdio.h>

#include "importer.h"

enum { STEPS = 200, HALF = 100 };
static const double STEP = 0.01; /* s */

static void print(const double values[], size_t count) {
    for (size_t i = 0; i < count; i++) {
        printf("%a ", values[i]);
    }
    printf("\n");
}

/* Communication steps with forces that change, with their derivatives; prints states and outputs after each. */
static void steps(const Fmu *fmu, fmi2Component c, const Log *log, int first, int end) {
    fmi2ValueReference inputs[MAX_VARIABLES], outputs[MAX_VARIABLES];
    fmi2Integer orders[MAX_VARIABLES];
    double values[MAX_VARIABLES], slopes[MAX_VARIABLES];
    const size_t n_inputs = references_of(fmu, "u", inputs), n_outputs = references_of(fmu, "xy", outputs);
    for (int i = first; i < end; i++) {
        for (size_t k = 0; k < n_inputs; k++) {
            values[k] = 0.1 * sin(0.05 * i + (double)k);
            slopes[k] = 0.5 * cos(0.05 * i + (double)k);
            orders[k] = 1;
        }
        expect(fmu->SetReal(c, inputs, n_inputs, values) == fmi2OK, "%s", log->text);
        expect(fmu->SetRealInputDerivatives(c, inputs, n_inputs, orders, slopes) == fmi2OK, "%s", log->text);
        expect(fmu->DoStep(c, i * STEP, STEP, fmi2True) == fmi2OK, "%s", log->text);
        expect(fmu->GetReal(c, outputs, n_outputs, values) == fmi2OK, "%s", log->text);
        print(values, n_outputs);
    }
}

/* Model exchange at one point: derivatives of the states, and the rows of their Jacobian. */
static void exchange(const Fmu *fmu) {
    fmi2ValueReference states[MAX_VARIABLES], derivatives[MAX_VARIABLES];
    double values[MAX_VARIABLES], seed = 1.0;
    Log log;
    fmi2Component c = start(fmu, fmi2ModelExchange, &log);
    const size_t n_states = references_of(fmu, "x", states), n_derivatives = references_of(fmu, "d", derivatives);
    expect(fmu->SetTime(c, 0.3) == fmi2OK, "%s", log.text);
    expect(fmu->GetDerivatives(c, values, fmu->states) == fmi2OK, "%s", log.text);
    print(values, fmu->states);
    for (size_t k = 0; k < n_states; k++) {
        expect(fmu->GetDirectionalDerivative(c, derivatives, n_derivatives, &states[k], 1, &seed, values) == fmi2OK,
               "%s", log.text);
        print(values, n_derivatives);
    }
    fmu->FreeInstance(c);
}

void move(const Fmu *fmu) {
    Log log;
    fmi2Component c = start(fmu, fmi2CoSimulation, &log);
    steps(fmu, c, &log, 0, STEPS);
    fmu->FreeInstance(c);
    exchange(fmu);
}

void save(const Fmu *fmu, const char *path) {
    static fmi2Byte bytes[MAX_BYTES];
    Log log;
    fmi2Component c = start(fmu, fmi2CoSimulation, &log);
    steps(fmu, c, &log, 0, HALF);
    const size_t size = serialize(fmu, c, bytes);
    FILE *file = fopen(path, "wb");
    expect(file != NULL && fwrite(bytes, 1, size, file) == size && fclose(file) == 0, "%s cannot be written", path);
    fmu->FreeInstance(c);
}

void go_on(const Fmu *fmu, const char *path) {
    static fmi2Byte bytes[MAX_BYTES];
    fmi2FMUstate state = NULL;
    Log log;
    fmi2Component c = instantiate(fmu, fmi2CoSimulation, &log);
    FILE *file = fopen(path, "rb");
    expect(file != NULL, "%s cannot be opened", path);
    const size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    expect(fmu->DeSerializeFMUstate(c, bytes, size, &state) == fmi2OK, "%s", log.text);
    expect(fmu->SetFMUstate(c, state) == fmi2OK && fmu->FreeFMUstate(c, &state) == fmi2OK, "%s", log.text);
    steps(fmu, c, &log, HALF, STEPS);
    fmu->FreeInstance(c);
}
