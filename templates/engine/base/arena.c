#include "arena.h"

Arena *arena_begin(void *memory, size_t capacity, size_t work) {
    Arena *arena = (Arena *)memory;
    arena->first.after = NULL;
    arena->first.begin = (char *)memory + ARENA_HEAD;
    arena->first.end = arena->first.begin + capacity;
    arena->block = &arena->first;
    arena->next = arena->first.begin;
    arena->end = arena->first.end;
    arena->work = work;
    arena->refused = 0;
    return arena;
}

void arena_end(Arena *arena) {
    if (arena != NULL) {
        arena_free_behind(&arena->first);
    }
}

bool arena_reserve(Arena *arena, size_t bytes) {
    if (bytes + arena->work <= (size_t)(arena->end - arena->next)) {
        return true;
    }
    ArenaBlock *block = arena_block_behind(arena->block, bytes + arena->work);
    if (block == NULL) {
        arena->refused = bytes;
        return false;
    }
    arena->block = block;
    arena->next = block->begin;
    arena->end = block->end;
    return true;
}
