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

/* The checksum of a serialized state: 64-bit FNV-1a of what stands behind a header of 5 words. */
enum { HEADER = 5 * 8 };
static void sign(fmi2Byte bytes[], size_t size) {
    uint64_t value = 0xcbf29ce484222325u;
    for (size_t i = HEADER; i < size; i++) {
        value = (value ^ (unsigned char)bytes[i]) * 0x100000001b3u;
    }
    memcpy(bytes + HEADER - 8, &value, sizeof value);
}

/* What an instance does with a state that was made up: anything but harm. Returns whether it took the state. */
static int take(const Fmu *fmu, fmi2Component c, const fmi2Byte bytes[], size_t size) {
    double values[MAX_VARIABLES];
    fmi2ValueReference references[MAX_VARIABLES];
    fmi2FMUstate state = NULL;
    if (fmu->DeSerializeFMUstate(c, bytes, size, &state) != fmi2OK) {
        return 0;
    }
    fmu->SetFMUstate(c, state);
    fmu->FreeFMUstate(c, &state);
    fmu->GetReal(c, references, references_of(fmu, "xcy", references), values);
    fmu->DoStep(c, 0.001, 0.001, fmi2True);
    fmu->GetReal(c, references, references_of(fmu, "xcy", references), values);
    return 1;
}

void forge(const Fmu *fmu, int count) {
    static const uint64_t WORDS[] = {UINT64_MAX, INT64_MAX, (uint64_t)1 << 63, (uint64_t)1 << 62, 0x7ff0000000000000u};
    static fmi2Byte bytes[MAX_BYTES];
    Log log;
    fmi2Component c = start(fmu, fmi2CoSimulation, &log);
    expect(fmu->DoStep(c, 0.0, 0.001, fmi2True) == fmi2OK, "%s", log.text);
    const size_t size = serialize(fmu, c, bytes), words = (size - HEADER) / 8;
    sign(bytes, size);
    expect(take(fmu, c, bytes, size), "the checksum of the state is not known: %s", log.text);
    int taken = 0;
    for (int i = 0; i < count; i++) {
        fmi2Byte *place = bytes + HEADER + 8 * ((size_t)i % words);
        const uint64_t word = WORDS[(size_t)i / words % (sizeof WORDS / sizeof WORDS[0])];
        uint64_t kept;
        memcpy(&kept, place, sizeof kept);
        memcpy(place, &word, sizeof word);
        sign(bytes, size);
        taken += take(fmu, c, bytes, size);
        memcpy(place, &kept, sizeof kept);
    }
    fmu->FreeInstance(c);
    printf("%d of %d taken\n", taken, count);
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
