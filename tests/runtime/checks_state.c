/* Saved states: rollback, serialization, refusal of blocks that do not fit, independence of instances. */
#include <string.h>

#include "checks.h"
#include "host.h"

enum { INSTANCES = 100, STEPS = 10 };

/* Takes an irregular step with a new input, and reads some variables in between, which must not matter. */
static void wander(fmi2Component c, int i, int reads) {
    CHECK(i % 3 != 0 || set(c, Q_THETA1, 0.1 * i) == fmi2OK);
    CHECK(i % 5 != 0 || set(c, L2, 0.6 + 0.01 * i) == fmi2OK);
    CHECK(fmi2DoStep(c, get(c, TIME), 0.01 * (1 + i % 7), fmi2False) == fmi2OK);
    for (int k = 0; k < reads; k++) {
        CHECK(get(c, X_TIP_DDOT) == get(c, X_TIP_DDOT));
    }
}

void check_rollback(void) {
    fmi2Byte first[SNAPSHOT_SIZE], second[SNAPSHOT_SIZE];
    fmi2FMUstate saved = NULL;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    wander(c, 1, 0);
    const double acceleration = get(c, X_TIP_DDOT), reach = get(c, REACH);
    CHECK(fmi2GetFMUstate(c, &saved) == fmi2OK);
    for (int i = 2; i < 20; i++) {
        wander(c, i, 0);
    }
    size_t size = snapshot(c, first);
    CHECK(get(c, X_TIP_DDOT) != acceleration && get(c, REACH) != reach);
    CHECK(fmi2SetFMUstate(c, saved) == fmi2OK);
    CHECK(get(c, X_TIP_DDOT) == acceleration && get(c, REACH) == reach); /* nothing calculated survives a restore */
    for (int i = 2; i < 20; i++) {
        wander(c, i, 3);
    }
    CHECK(snapshot(c, second) == size && memcmp(first, second, size) == 0);

    /* a block is used again, and leads out of the error state */
    const fmi2FMUstate same = saved;
    CHECK(fmi2GetFMUstate(c, &saved) == fmi2OK && saved == same);
    CHECK(fmi2DoStep(c, -1.0, 0.1, fmi2True) == fmi2Error);
    CHECK(fmi2SetFMUstate(c, saved) == fmi2OK && snapshot(c, first) == size && memcmp(first, second, size) == 0);
    wander(c, 1, 0);
    CHECK(fmi2FreeFMUstate(c, &saved) == fmi2OK && saved == NULL && fmi2FreeFMUstate(c, &saved) == fmi2OK);
    fmi2FreeInstance(c);
}

void check_serialization(void) {
    fmi2Byte bytes[SNAPSHOT_SIZE + 1];
    fmi2FMUstate state = NULL;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    fmi2Component other = instantiate(fmi2CoSimulation, &log); /* in another state, with other values */
    for (int i = 1; i < 9; i++) {
        wander(c, i, 0);
    }
    const size_t size = snapshot(c, bytes + 1); /* misaligned on purpose */
    CHECK(fmi2DeSerializeFMUstate(other, bytes + 1, size, &state) == fmi2OK);
    CHECK(fmi2SetFMUstate(other, state) == fmi2OK && same_state(c, other));
    wander(c, 9, 2);
    wander(other, 9, 0);
    CHECK(same_state(c, other));

    CHECK(fmi2SerializeFMUstate(c, state, bytes, size - 1) == fmi2Error && said(&log, "expected a buffer of"));
    CHECK(fmi2SerializeFMUstate(c, state, NULL, size) == fmi2Error);
    CHECK(fmi2SerializedFMUstateSize(c, state, NULL) == fmi2Error);
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    fmi2FreeInstance(c);
    fmi2FreeInstance(other);
}

void check_foreign_states(void) {
    fmi2Byte bytes[SNAPSHOT_SIZE];
    fmi2FMUstate state = NULL;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    const size_t size = snapshot(c, bytes);
    for (size_t i = 0; i < size; i++) { /* any changed byte is found */
        bytes[i] = (fmi2Byte)(bytes[i] ^ 0x10);
        CHECK(fmi2DeSerializeFMUstate(c, bytes, size, &state) == fmi2Error && state == NULL);
        bytes[i] = (fmi2Byte)(bytes[i] ^ 0x10);
    }
    CHECK(said(&log, "damaged"));
    CHECK(fmi2DeSerializeFMUstate(c, bytes, size - 8, &state) == fmi2Error && said(&log, "bytes"));
    CHECK(fmi2DeSerializeFMUstate(c, NULL, size, &state) == fmi2Error);
    CHECK(fmi2DeSerializeFMUstate(c, bytes, size, NULL) == fmi2Error);
    CHECK(fmi2DeSerializeFMUstate(c, bytes, size, &state) == fmi2OK && fmi2SetFMUstate(c, state) == fmi2OK);

    fmi2Component exchange = start(fmi2ModelExchange, &log);
    CHECK(fmi2SetFMUstate(exchange, state) == fmi2Error && said(&log, "other type"));
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    fmi2FreeInstance(exchange);
    fmi2FreeInstance(c);
}

void check_interleaved(void) {
    static Log logs[INSTANCES], log;
    fmi2Component crowd[INSTANCES];
    for (int k = 0; k < INSTANCES; k++) {
        crowd[k] = start(fmi2CoSimulation, &logs[k]);
        CHECK(set(crowd[k], Q_THETA2, 0.1 * k) == fmi2OK);
    }
    for (int i = 0; i < STEPS; i++) {
        for (int k = 0; k < INSTANCES; k++) {
            CHECK(fmi2DoStep(crowd[k], 0.05 * i, 0.05, fmi2True) == fmi2OK);
        }
    }
    for (int k = 0; k < INSTANCES; k++) {
        fmi2Component alone = start(fmi2CoSimulation, &log);
        CHECK(set(alone, Q_THETA2, 0.1 * k) == fmi2OK && steps(alone, 0.0, 0.05, STEPS) == fmi2OK);
        CHECK(same_state(alone, crowd[k]));
        fmi2FreeInstance(alone);
        fmi2FreeInstance(crowd[k]);
    }
}

void check_same_bits(void) {
    Log log;
    fmi2Component a = start(fmi2CoSimulation, &log);
    fmi2Component b = start(fmi2CoSimulation, &log);
    CHECK(set(a, Q_THETA1, 0.7) == fmi2OK && set(b, Q_THETA1, 0.7) == fmi2OK);
    CHECK(steps(a, 0.0, 0.1, 3) == fmi2OK && steps(b, 0.0, 0.1, 3) == fmi2OK);
    CHECK(set(a, Q_THETA1, 0.7) == fmi2OK && set(a, M1, 1.5) == fmi2OK);
    CHECK(same_state(a, b)); /* the stored derivative is still valid */
    CHECK(set(a, Q_THETA1, 0.8) == fmi2OK && !same_state(a, b));
    fmi2FreeInstance(a);
    fmi2FreeInstance(b);
}
