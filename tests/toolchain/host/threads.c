/* Many instances at a time, each in a thread of its own; Windows has other threads. */
#include <stdio.h>
#include <string.h>

#include "importer.h"

#ifndef _WIN32
#include <pthread.h>

enum { MAX_THREADS = 256, VARIANTS = 10, STEPS = 5 };

typedef struct {
    const Fmu *fmu;
    int variant; /* instances of the same variant must move the same */
    size_t size;
    fmi2Byte bytes[2][MAX_BYTES]; /* the final states of co-simulation and model exchange */
} Job;

/* Moves an instance with forces that depend on the variant, and makes it complain on the way. */
static void work(Job *job, fmi2Type type) {
    const Fmu *fmu = job->fmu;
    fmi2ValueReference inputs[MAX_VARIABLES], none = 1000000;
    double values[MAX_VARIABLES], derivatives[MAX_STATES];
    fmi2FMUstate state = NULL;
    Log log;
    fmi2Component c = start(fmu, type, &log);
    const size_t count = references_of(fmu, "u", inputs);
    for (int i = 0; i < STEPS; i++) {
        for (size_t k = 0; k < count; k++) {
            values[k] = 0.1 * job->variant + 0.01 * i;
        }
        expect(fmu->SetReal(c, inputs, count, values) == fmi2OK, "%s", log.text);
        expect(fmu->GetFMUstate(c, &state) == fmi2OK, "%s", log.text);
        expect(fmu->GetReal(c, &none, 1, values) == fmi2Error && log.count == i + 1, "a wrong reference is accepted");
        expect(fmu->SetFMUstate(c, state) == fmi2OK, "%s", log.text);
        if (type == fmi2CoSimulation) {
            expect(fmu->DoStep(c, 0.01 * i, 0.01, fmi2False) == fmi2OK, "%s", log.text);
        } else {
            expect(fmu->SetTime(c, 0.01 * i) == fmi2OK, "%s", log.text);
            expect(fmu->GetDerivatives(c, derivatives, fmu->states) == fmi2OK, "%s", log.text);
        }
    }
    expect(fmu->FreeFMUstate(c, &state) == fmi2OK, "%s", log.text);
    job->size = serialize(fmu, c, job->bytes[type]);
    fmu->FreeInstance(c);
}

static void *both(void *job) {
    work(job, fmi2CoSimulation);
    work(job, fmi2ModelExchange);
    return NULL;
}

void threads(const Fmu *fmu, int count) {
    static Job alone[VARIANTS], jobs[MAX_THREADS];
    pthread_t running[MAX_THREADS];
    expect(count <= MAX_THREADS, "%d threads are too many", count);
    for (int i = 0; i < VARIANTS; i++) {
        alone[i].fmu = fmu;
        alone[i].variant = i;
        both(&alone[i]);
    }
    for (int i = 0; i < count; i++) {
        jobs[i].fmu = fmu;
        jobs[i].variant = i % VARIANTS;
        expect(pthread_create(&running[i], NULL, both, &jobs[i]) == 0, "thread %d cannot be started", i);
    }
    for (int i = 0; i < count; i++) {
        expect(pthread_join(running[i], NULL) == 0, "thread %d cannot be joined", i);
    }
    for (int i = 0; i < count; i++) {
        const Job *other = &alone[i % VARIANTS];
        expect(jobs[i].size == other->size && memcmp(jobs[i].bytes, other->bytes, sizeof other->bytes) == 0,
               "thread %d moved differently from an instance that was alone", i);
    }
    expect(memcmp(alone[0].bytes, alone[1].bytes, sizeof alone[0].bytes) != 0, "the variants do not differ");
    printf("%d threads\n", count);
}

typedef struct {
    const Fmu *fmu;
    fmi2Component component;
} Shared;

static void *use(void *shared) {
    const Shared *s = shared;
    const fmi2ValueReference first = 0;
    double value;
    s->fmu->GetReal(s->component, &first, 1, &value);
    return NULL;
}

void race(const Fmu *fmu) {
    Log log;
    Shared shared = {fmu, instantiate(fmu, fmi2CoSimulation, &log)};
    pthread_t one, other;
    pthread_create(&one, NULL, use, &shared);
    pthread_create(&other, NULL, use, &shared);
    pthread_join(one, NULL);
    pthread_join(other, NULL);
    fmu->FreeInstance(shared.component);
}
#else
void threads(const Fmu *fmu, int count) { expect(0, "no threads for %s, %d", fmu->guid, count); }
void race(const Fmu *fmu) { threads(fmu, 2); }
#endif
