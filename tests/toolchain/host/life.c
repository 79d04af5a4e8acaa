/* Instances that come and go. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "importer.h"

/* Starts an instance, lets it work, saves and restores it, resets it, lets it work again, frees it. */
static void cycle(const Fmu *fmu, fmi2Type type) {
    static const int TIMES = 2;
    Log log;
    double derivatives[MAX_STATES];
    fmi2FMUstate state = NULL;
    fmi2Component c = instantiate(fmu, type, &log);
    for (int i = 0; i < TIMES; i++) {
        expect(fmu->EnterInitializationMode(c) == fmi2OK && fmu->ExitInitializationMode(c) == fmi2OK, "%s", log.text);
        expect(fmu->GetFMUstate(c, &state) == fmi2OK, "%s", log.text);
        if (type == fmi2CoSimulation) {
            expect(fmu->DoStep(c, 0.0, 0.001, fmi2True) == fmi2OK, "%s", log.text);
        } else {
            expect(fmu->GetDerivatives(c, derivatives, fmu->states) == fmi2OK, "%s", log.text);
        }
        expect(fmu->SetFMUstate(c, state) == fmi2OK && fmu->FreeFMUstate(c, &state) == fmi2OK, "%s", log.text);
        expect(fmu->Reset(c) == fmi2OK, "%s", log.text);
    }
    fmu->FreeInstance(c);
}

void cycles(const Fmu *fmu, int count) {
    for (int i = 0; i < count; i++) {
        cycle(fmu, i % 2 == 0 ? fmi2CoSimulation : fmi2ModelExchange);
    }
    printf("%d cycles\n", count);
}

void leak(const Fmu *fmu) {
    Log log;
    fmi2Component c = instantiate(fmu, fmi2CoSimulation, &log);
    memset(&c, 0, sizeof c); /* never freed */
}

void overrun(const Fmu *fmu) {
    Log log;
    fmi2Byte *bytes = malloc(8);
    fmi2FMUstate state = NULL;
    fmi2Component c = instantiate(fmu, fmi2CoSimulation, &log);
    expect(fmu->DeSerializeFMUstate(c, bytes, MAX_BYTES, &state) == fmi2Error, "of a wrong size");
    size_t size = serialize(fmu, c, (fmi2Byte[MAX_BYTES]){0});
    fmu->DeSerializeFMUstate(c, bytes, size, &state); /* reads behind the 8 bytes */
    free(bytes);
    fmu->FreeInstance(c);
}
