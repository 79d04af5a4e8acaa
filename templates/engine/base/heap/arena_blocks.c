#include "arena_blocks.h"

#include <stdlib.h>

enum { BLOCK_HEAD = (sizeof(ArenaBlock) + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT };

void arena_free_behind(ArenaBlock *block) {
    while (block->after != NULL) {
        ArenaBlock *freed = block->after;
        block->after = freed->after;
        free(freed);
    }
}

ArenaBlock *arena_block_behind(ArenaBlock *block, size_t bytes) {
    if (block->after != NULL && (size_t)(block->after->end - block->after->begin) >= bytes) {
        return block->after;
    }
    arena_free_behind(block);
    ArenaBlock *made = (ArenaBlock *)malloc(BLOCK_HEAD + bytes);
    if (made != NULL) {
        made->after = NULL;
        made->begin = (char *)made + BLOCK_HEAD;
        made->end = made->begin + bytes;
        block->after = made;
    }
    return made;
}
