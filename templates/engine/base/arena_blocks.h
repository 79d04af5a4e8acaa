/* Further blocks of an arena: from the heap, or none where there is no heap. */
#ifndef ARENA_BLOCKS_H
#define ARENA_BLOCKS_H

#include <stddef.h>

enum { ARENA_UNIT = 16 }; /* bytes; all arrays begin at a multiple of it */

typedef struct ArenaBlock {
    struct ArenaBlock *after; /* NULL, or the block that is used when this one is full */
    char *begin, *end;        /* its memory */
} ArenaBlock;

/* The block behind the one in use, which is made or made anew if it has not `bytes` bytes; nothing behind is in use.
   NULL: there is no memory. */
ArenaBlock *arena_block_behind(ArenaBlock *block, size_t bytes);

/* Frees the blocks behind this one. */
void arena_free_behind(ArenaBlock *block);

#endif
