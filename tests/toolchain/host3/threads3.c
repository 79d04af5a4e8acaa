/* Many instances, each in a thread of its own. */
#include <stdio.h>
#include <string.h>

#include "host3.h"

#ifdef _WIN32
void threads(int count) { expect(0, "no %d threads here", count); }
#else
#include <pthread.h>

enum { MAX_THREADS = 256, VARIANTS = 10, STEPS = 20 };

typedef struct {
    int variant;
    size_t size;
    fmi3Byte bytes[2][MAX_BYTES]; /* the final states of model exchange and co-simulation */
} Job;

/* Moves an instance over events; a call that is refused ends the life of another one on the way. */
static void work(Job *job, int co_simulation) {
    const fmi3ValueReference none = N_PORTS;
    double value;
    Unit unit, other;
    start(&unit, co_simulation, job->variant);
    for (int i = 0; i < STEPS; i++) {
        start(&other, co_simulation, job->variant);
        expect(fmi3GetFloat64(other.instance, &none, 1, &value, 1) == fmi3Error, "a wrong reference is accepted");
        fmi3FreeInstance(other.instance);
        advance(&unit, 0.05 * i, 0.05 * (i + 1), NULL);
    }
    job->size = bytes_of(&unit, job->bytes[co_simulation]);
    fmi3FreeInstance(unit.instance);
}

static void *both(void *job) {
    work(job, 0);
    work(job, 1);
    return NULL;
}

void threads(int count) {
    static Job alone[VARIANTS], jobs[MAX_THREADS];
    pthread_t running[MAX_THREADS];
    expect(count <= MAX_THREADS, "%d threads are too many", count);
    for (int i = 0; i < VARIANTS; i++) {
        alone[i].variant = i;
        both(&alone[i]);
    }
    for (int i = 0; i < count; i++) {
        jobs[i].variant = i % VARIANTS;
        expect(pthread_create(&running[i], NULL, both, &jobs[i]) == 0, "thread %d cannot be started", i);
    }
    for (int i = 0; i < count; i++) {
        expect(pthread_join(running[i], NULL) == 0, "thread %d cannot be joined", i);
        const Job *other = &alone[i % VARIANTS];
        expect(jobs[i].size == other->size && memcmp(jobs[i].bytes, other->bytes, sizeof other->bytes) == 0,
               "thread %d moved differently from an instance that was alone", i);
    }
    expect(memcmp(alone[0].bytes, alone[1].bytes, sizeof alone[0].bytes) != 0, "the variants do not differ");
    printf("%d threads\n", count);
}
#endif
