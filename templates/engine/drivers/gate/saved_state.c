#include "saved_state.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "logging.h"

/* What the importer holds: a header that tells what the block is, and copies of the Session and the State. The block is
   plain data; its bytes in memory are also its serialized form. */
typedef struct {
    uint64_t magic;   /* MAGIC; reads backwards, and is refused, on a big-endian machine */
    uint64_t version; /* of this layout */
    uint64_t size;    /* of the block, bytes */
    uint64_t guid;    /* hash of MODEL_GUID */
    uint64_t payload; /* hash of what follows */
    Session session;
    State state;
} Block;

static const uint64_t MAGIC = 0x00756d663267616cu; /* "lag2fmu\0" in little-endian bytes */
static const uint64_t VERSION = 7;

/* 64-bit FNV-1a (Fowler, Noll, Vo) of some bytes. */
static uint64_t hash(const void *bytes, size_t size) {
    const unsigned char *byte = (const unsigned char *)bytes;
    uint64_t value = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++) {
        value = (value ^ byte[i]) * 0x100000001b3u;
    }
    return value;
}

static uint64_t payload_hash(const Block *block) {
    return hash(&block->session, sizeof(Block) - offsetof(Block, session));
}

/* Fills a block from the component. */
static void save(const Component *component, Block *block) {
    block->magic = MAGIC;
    block->version = VERSION;
    block->size = sizeof(Block);
    block->guid = hash(MODEL_GUID, strlen(MODEL_GUID));
    block->session = component->session;
    memcpy(&block->state, &component->instance.state, sizeof(State));
    block->payload = payload_hash(block);
}

/* What is wrong with a block for this instance, as the end of a sentence; NULL if nothing is. */
static const char *fault_of(const Component *component, const Block *block) {
    if (block->magic != MAGIC) {
        return "is not a state of an FMU made by lag2fmu on a machine of this byte order";
    }
    if (block->version != VERSION || block->size != sizeof(Block)) {
        return "has another layout; it was saved by an FMU of another version";
    }
    if (block->guid != hash(MODEL_GUID, strlen(MODEL_GUID))) {
        return "belongs to an FMU with another GUID";
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

/* Checks a block that the importer handed in: STATUS_OK, or STATUS_ERROR after saying what is wrong with it. */
static Status check(Component *component, const Block *block) {
    if (block == NULL) {
        return fail(component, "the state is NULL; expected one made by " GET_STATE " or " DESERIALIZE_STATE);
    }
    const char *fault = fault_of(component, block);
    return fault == NULL ? STATUS_OK : fail(component, "the given state %s; nothing was changed", fault);
}

Status get_state(void *handle, Call call, void **saved) {
    Component *component = enter_present(handle, call);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    if (saved == NULL) {
        return fail(component, "the argument for the state is NULL; expected the address of a pointer");
    }
    if (*saved == NULL) {
        *saved = malloc(sizeof(Block));
    } else if (check(component, (const Block *)*saved) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (*saved == NULL) {
        return fail(component, "there is no memory for a state of %u bytes", (unsigned)sizeof(Block));
    }
    save(component, (Block *)*saved);
    return STATUS_OK;
}

Status set_state(void *handle, Call call, void *saved) {
    Component *component = enter(handle, call);
    if (component == NULL || check(component, (const Block *)saved) != STATUS_OK) {
        return STATUS_ERROR;
    }
    const Block *block = (const Block *)saved;
    component->session = block->session;
    memcpy(&component->instance.state, &block->state, sizeof(State));
    instance_forget_cache(&component->instance);
    return STATUS_OK;
}

Status free_state(void *handle, Call call, void **saved) {
    Component *component = enter(handle, call);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    if (saved == NULL || *saved == NULL) {
        return STATUS_OK;
    }
    if (check(component, (const Block *)*saved) != STATUS_OK) {
        return STATUS_ERROR;
    }
    free(*saved);
    *saved = NULL;
    return STATUS_OK;
}

Status state_size(void *handle, Call call, void *saved, size_t *size) {
    Component *component = enter(handle, call);
    if (component == NULL || check(component, (const Block *)saved) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (size == NULL) {
        return fail(component, "the argument size is NULL; expected the address of a size_t");
    }
    *size = sizeof(Block);
    return STATUS_OK;
}

Status serialize_state(void *handle, Call call, void *saved, void *bytes, size_t size) {
    Component *component = enter(handle, call);
    if (component == NULL || check(component, (const Block *)saved) != STATUS_OK) {
        return STATUS_ERROR;
    }
    if (bytes == NULL || size != sizeof(Block)) {
        return fail(component, "expected a buffer of %u bytes (" SERIALIZED_STATE_SIZE "), but got %u bytes at %s",
                    (unsigned)sizeof(Block), (unsigned)size, bytes == NULL ? "NULL" : "an address");
    }
    memcpy(bytes, saved, sizeof(Block));
    return STATUS_OK;
}

Status deserialize_state(void *handle, Call call, const void *bytes, size_t size, void **saved) {
    Component *component = enter(handle, call);
    if (component == NULL) {
        return STATUS_ERROR;
    }
    if (bytes == NULL || saved == NULL || size != sizeof(Block)) {
        return fail(component, "expected %u bytes of " SERIALIZE_STATE " and the address of a pointer, but got %u "
                    "bytes%s", (unsigned)sizeof(Block), (unsigned)size,
                    bytes == NULL || saved == NULL ? " and a NULL argument" : "");
    }
    Block *block = (Block *)malloc(sizeof *block);
    if (block == NULL) {
        return fail(component, "there is no memory for a state of %u bytes", (unsigned)sizeof(Block));
    }
    memcpy(block, bytes, sizeof *block);
    if (check(component, block) != STATUS_OK) {
        free(block);
        return STATUS_ERROR;
    }
    *saved = block;
    return STATUS_OK;
}
