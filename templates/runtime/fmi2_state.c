/* Saved states: fmi2GetFMUstate and its relatives. */
#include <stdlib.h>
#include <string.h>

#include "instance.h"
#include "logging.h"

/* An fmi2FMUstate: a header that tells what the block is, and a copy of the State. The block is plain data; its bytes
   in memory are also its serialized form. */
typedef struct {
    uint64_t magic;   /* MAGIC; reads backwards, and is refused, on a big-endian machine */
    uint64_t version; /* of this layout */
    uint64_t size;    /* of State, bytes */
    uint64_t guid;    /* hash of MODEL_GUID */
    uint64_t payload; /* hash of the State */
    State state;
} FmuState;

static const uint64_t MAGIC = 0x00756d663267616cu; /* "lag2fmu\0" in little-endian bytes */
static const uint64_t VERSION = 3;

/* 64-bit FNV-1a (Fowler, Noll, Vo) of some bytes. */
static uint64_t hash(const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    uint64_t value = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++) {
        value = (value ^ byte[i]) * 0x100000001b3u;
    }
    return value;
}

/* Fills a block from the instance. */
static void save(const Instance *instance, FmuState *block) {
    block->magic = MAGIC;
    block->version = VERSION;
    block->size = sizeof(State);
    block->guid = hash(MODEL_GUID, strlen(MODEL_GUID));
    block->payload = hash(&instance->state, sizeof(State));
    memcpy(&block->state, &instance->state, sizeof(State));
}

/* Are all numbers in range that index or count? A checksum keeps damage out, but not who can compute it. */
static bool in_range(const State *state) {
    const int64_t most = INT64_MAX / 2; /* no run counts so far */
    bool sound = state->steps >= 0 && state->steps <= most && state->stiff_steps >= 0 && state->stiff_steps <= most &&
                 state->easy_steps >= 0 && state->easy_steps <= most;
#if N_CONSTRAINTS > 0
    bool met[N_CONSTRAINTS] = {false};
    sound = sound && state->rows.rank >= 0 && state->rows.rank <= N_CONSTRAINTS;
    for (int k = 0; k < N_CONSTRAINTS && sound && state->rows_known; k++) {
        const int64_t row = state->rows.order[k];
        sound = row >= 0 && row < N_CONSTRAINTS && !met[row];
        if (sound) {
            met[row] = true;
        }
    }
#endif
    return sound;
}

/* What is wrong with a block for this instance, as the end of a sentence; NULL if nothing is. */
static const char *fault_of(const Instance *instance, const FmuState *block) {
    if (block->magic != MAGIC) {
        return "is not a state of an FMU made by lag2fmu on a machine of this byte order";
    }
    if (block->version != VERSION || block->size != sizeof(State)) {
        return "has another layout; it was saved by an FMU of another version";
    }
    if (block->guid != hash(MODEL_GUID, strlen(MODEL_GUID))) {
        return "belongs to an FMU with another GUID than " MODEL_GUID;
    }
    if (block->payload != hash(&block->state, sizeof(State))) {
        return "is damaged: its checksum does not match";
    }
    if (block->state.type != (int64_t)instance->type || block->state.mode < 0 || block->state.mode >= N_MODES) {
        return "was saved by an instance of the other type; model exchange and co-simulation do not share states";
    }
    if (!in_range(&block->state)) {
        return "is damaged: it holds a count or an index out of range";
    }
    return NULL;
}

/* Checks a block that the importer handed in; returns fmi2OK, or fmi2Error after reporting what is wrong with it. */
static fmi2Status check(Instance *instance, const FmuState *block) {
    if (block == NULL) {
        return fail(instance, "the state is NULL; expected one made by fmi2GetFMUstate or fmi2DeSerializeFMUstate");
    }
    const char *fault = fault_of(instance, block);
    return fault == NULL ? fmi2OK : fail(instance, "the given state %s; nothing was changed", fault);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *instance = instance_enter_present(c, CALL_GetFMUstate);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (FMUstate == NULL) {
        return fail(instance, "the argument FMUstate is NULL; expected the address of a pointer");
    }
    if (*FMUstate == NULL) {
        *FMUstate = malloc(sizeof(FmuState));
    } else if (check(instance, *FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    if (*FMUstate == NULL) {
        return fail(instance, "there is no memory for a state of %u bytes", (unsigned)sizeof(FmuState));
    }
    save(instance, *FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    Instance *instance = instance_enter(c, CALL_SetFMUstate);
    if (instance == NULL || check(instance, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    memcpy(&instance->state, &((const FmuState *)FMUstate)->state, sizeof(State));
    instance_forget_cache(instance);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *instance = instance_enter(c, CALL_FreeFMUstate);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (FMUstate == NULL || *FMUstate == NULL) {
        return fmi2OK;
    }
    if (check(instance, *FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    free(*FMUstate);
    *FMUstate = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    Instance *instance = instance_enter(c, CALL_SerializedFMUstateSize);
    if (instance == NULL || check(instance, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    if (size == NULL) {
        return fail(instance, "the argument size is NULL; expected the address of a size_t");
    }
    *size = sizeof(FmuState);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    Instance *instance = instance_enter(c, CALL_SerializeFMUstate);
    if (instance == NULL || check(instance, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    if (serializedState == NULL || size != sizeof(FmuState)) {
        return fail(instance, "expected a buffer of %u bytes (fmi2SerializedFMUstateSize), but got %u bytes at %s",
                    (unsigned)sizeof(FmuState), (unsigned)size, serializedState == NULL ? "NULL" : "an address");
    }
    memcpy(serializedState, FMUstate, sizeof(FmuState));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    Instance *instance = instance_enter(c, CALL_DeSerializeFMUstate);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (serializedState == NULL || FMUstate == NULL || size != sizeof(FmuState)) {
        return fail(instance, "expected %u bytes of fmi2SerializeFMUstate and the address of a pointer, but got %u "
                    "bytes%s", (unsigned)sizeof(FmuState), (unsigned)size,
                    serializedState == NULL || FMUstate == NULL ? " and a NULL argument" : "");
    }
    FmuState *block = malloc(sizeof *block);
    if (block == NULL) {
        return fail(instance, "there is no memory for a state of %u bytes", (unsigned)sizeof(FmuState));
    }
    memcpy(block, serializedState, sizeof *block);
    if (check(instance, block) != fmi2OK) {
        free(block);
        return fmi2Error;
    }
    *FMUstate = block;
    return fmi2OK;
}
