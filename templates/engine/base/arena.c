#include "arena.h"

#include <stdlib.h>

enum { BLOCK_HEAD = (sizeof(ArenaBlock) + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT };

Arena *arena_begin(void *memory, size_t capacity) {
    Arena *arena = memory;
    arena->first.after = NULL;
    arena->first.begin = (char *)memory + ARENA_HEAD;
    arena->first.end = arena->first.begin + capacity;
    arena->block = &arena->first;
    arena->next = arena->first.begin;
    arena->end = arena->first.end;
    arena->refused = 0;
    return arena;
}

static void free_behind(ArenaBlock *block) {
    while (block->after != NULL) {
        ArenaBlock *freed = block->after;
        block->after = freed->after;
        free(freed);
    }
}

void arena_end(Arena *arena) {
    if (arena != NULL) {
        free_behind(&arena->first);
    }
}

/* The block behind the one in use, with so many bytes at least; nothing behind is in use. NULL: there is no memory. */
static ArenaBlock *block_behind(ArenaBlock *block, size_t bytes) {
    if (block->after != NULL && (size_t)(block->after->end - block->after->begin) >= bytes) {
        return block->after;
    }
    free_behind(block);
    ArenaBlock *made = malloc(BLOCK_HEAD + bytes);
    if (made != NULL) {
        made->after = NULL;
        made->begin = (char *)made + BLOCK_HEAD;
        made->end = made->begin + bytes;
        block->after = made;
    }
    return made;
}

bool arena_reserve(Arena *arena, size_t bytes) {
    if (bytes <= (size_t)(arena->end - arena->next)) {
        return true;
    }
    ArenaBlock *block = block_behind(arena->block, bytes);
    if (block == NULL) {
        arena->refused = bytes;
        return false;
    }
    arena->block = block;
    arena->next = block->begin;
    arena->end = block->end;
    return true;
}
