/* Saved states: fmi2GetFMUstate and its relatives. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "gate.h"
#include "logging.h"

/* An fmi2FMUstate: a header that tells what the block is, and copies of the Session and the State. The block is plain
   data; its bytes in memory are also its serialized form. */
typedef struct {
    uint64_t magic;   /* MAGIC; reads backwards, and is refused, on a big-endian machine */
    uint64_t version; /* of this layout */
    uint64_t size;    /* of the block, bytes */
    uint64_t guid;    /* hash of MODEL_GUID */
    uint64_t payload; /* hash of what follows */
    Session session;
    State state;
} FmuState;

static const uint64_t MAGIC = 0x00756d663267616cu; /* "lag2fmu\0" in little-endian bytes */
static const uint64_t VERSION = 5;

/* 64-bit FNV-1a (Fowler, Noll, Vo) of some bytes. */
static uint64_t hash(const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    uint64_t value = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++) {
        value = (value ^ byte[i]) * 0x100000001b3u;
    }
    return value;
}

static uint64_t payload_hash(const FmuState *block) {
    return hash(&block->session, sizeof(FmuState) - offsetof(FmuState, session));
}

/* Fills a block from the component. */
static void save(const Component *component, FmuState *block) {
    block->magic = MAGIC;
    block->version = VERSION;
    block->size = sizeof(FmuState);
    block->guid = hash(MODEL_GUID, strlen(MODEL_GUID));
    block->session = component->session;
    memcpy(&block->state, &component->instance.state, sizeof(State));
    block->payload = payload_hash(block);
}

/* What is wrong with a block for this instance, as the end of a sentence; NULL if nothing is. */
static const char *fault_of(const Component *component, const FmuState *block) {
    if (block->magic != MAGIC) {
        return "is not a state of an FMU made by lag2fmu on a machine of this byte order";
    }
    if (block->version != VERSION || block->size != sizeof(FmuState)) {
        return "has another layout; it was saved by an FMU of another version";
    }
    if (block->guid != hash(MODEL_GUID, strlen(MODEL_GUID))) {
        return "belongs to an FMU with another GUID than " MODEL_GUID;
    }
    if (block->payload != payload_hash(block)) {
        return "is damaged: its checksum does not match";
    }
    if (block->session.type != (int64_t)component->type || block->session.mode < 0 ||
        block->session.mode >= N_MODES) {
        return "was saved by an instance of the other type; model exchange and co-simulation do not share states";
    }
    if (!state_in_range(&block->state)) {
        return "is damaged: it holds a count or an index out of range";
    }
    return NULL;
}

/* Checks a block that the importer handed in; returns fmi2OK, or fmi2Error after reporting what is wrong with it. */
static fmi2Status check(Component *component, const FmuState *block) {
    if (block == NULL) {
        return fail(component, "the state is NULL; expected one made by fmi2GetFMUstate or fmi2DeSerializeFMUstate");
    }
    const char *fault = fault_of(component, block);
    return fault == NULL ? fmi2OK : fail(component, "the given state %s; nothing was changed", fault);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Component *component = enter_present(c, CALL_GetFMUstate);
    if (component == NULL) {
        return fmi2Error;
    }
    if (FMUstate == NULL) {
        return fail(component, "the argument FMUstate is NULL; expected the address of a pointer");
    }
    if (*FMUstate == NULL) {
        *FMUstate = malloc(sizeof(FmuState));
    } else if (check(component, *FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    if (*FMUstate == NULL) {
        return fail(component, "there is no memory for a state of %u bytes", (unsigned)sizeof(FmuState));
    }
    save(component, *FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    Component *component = enter(c, CALL_SetFMUstate);
    if (component == NULL || check(component, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    const FmuState *block = FMUstate;
    component->session = block->session;
    memcpy(&component->instance.state, &block->state, sizeof(State));
    instance_forget_cache(&component->instance);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Component *component = enter(c, CALL_FreeFMUstate);
    if (component == NULL) {
        return fmi2Error;
    }
    if (FMUstate == NULL || *FMUstate == NULL) {
        return fmi2OK;
    }
    if (check(component, *FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    free(*FMUstate);
    *FMUstate = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    Component *component = enter(c, CALL_SerializedFMUstateSize);
    if (component == NULL || check(component, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    if (size == NULL) {
        return fail(component, "the argument size is NULL; expected the address of a size_t");
    }
    *size = sizeof(FmuState);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    Component *component = enter(c, CALL_SerializeFMUstate);
    if (component == NULL || check(component, FMUstate) != fmi2OK) {
        return fmi2Error;
    }
    if (serializedState == NULL || size != sizeof(FmuState)) {
        return fail(component, "expected a buffer of %u bytes (fmi2SerializedFMUstateSize), but got %u bytes at %s",
                    (unsigned)sizeof(FmuState), (unsigned)size, serializedState == NULL ? "NULL" : "an address");
    }
    memcpy(serializedState, FMUstate, sizeof(FmuState));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    Component *component = enter(c, CALL_DeSerializeFMUstate);
    if (component == NULL) {
        return fmi2Error;
    }
    if (serializedState == NULL || FMUstate == NULL || size != sizeof(FmuState)) {
        return fail(component, "expected %u bytes of fmi2SerializeFMUstate and the address of a pointer, but got %u "
                    "bytes%s", (unsigned)sizeof(FmuState), (unsigned)size,
                    serializedState == NULL || FMUstate == NULL ? " and a NULL argument" : "");
    }
    FmuState *block = malloc(sizeof *block);
    if (block == NULL) {
        return fail(component, "there is no memory for a state of %u bytes", (unsigned)sizeof(FmuState));
    }
    memcpy(block, serializedState, sizeof *block);
    if (check(component, block) != fmi2OK) {
        free(block);
        return fmi2Error;
    }
    *FMUstate = block;
    return fmi2OK;
}
