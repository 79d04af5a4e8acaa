/* Work memory of an instance: the arrays of a call whose size grows with the mechanism.

   The arena is a stack beside the instance. A function marks it, takes arrays, and gives all of them back when it
   returns. Nothing in it has a meaning between calls, so it is no part of the State. Its memory is allocated together
   with the instance; arena_size.h says how much. The laws of contacts, whose matrices are as large as what touches,
   reserve theirs before they take it, which may allocate a further block; that block stays until the instance ends.
   Where steps are bounded in real time there is no heap, and no further block (arena_blocks.h).

   Arrays of up to SMALL_WORK bytes lie on the stack of the call, so that small mechanisms pay nothing. With
   ARENA_ON_STACK all arrays of fixed size do: a compiler then tells how much memory they need, and a sanitizer sees
   what is written behind one. */
#ifndef ARENA_H
#define ARENA_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "arena_blocks.h"

typedef struct {
    char *next, *end;  /* the free memory of the block in use */
    ArenaBlock *block; /* in use */
    ArenaBlock first;
    size_t work;       /* bytes that calls take without a reservation */
    size_t refused;    /* bytes that could not be allocated at last; whoever asks puts it to 0 before */
} Arena;

/* Where an arena stands: what is taken later is given back by a return to it. */
typedef struct {
    Arena *arena;
    char *next;
    ArenaBlock *block;
} ArenaMark;

enum { ARENA_HEAD = (sizeof(Arena) + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT };

#ifndef SMALL_WORK
#define SMALL_WORK 512 /* bytes */
#endif

/* An arena in this memory of ARENA_HEAD + capacity bytes, which begins at a multiple of ARENA_UNIT. Calls may take
   `work` bytes without a reservation. */
Arena *arena_begin(void *memory, size_t capacity, size_t work);

/* Frees the blocks that were allocated since arena_begin. NULL is no arena. */
void arena_end(Arena *arena);

/* Makes room for arrays that take `bytes` bytes together, each rounded up to ARENA_UNIT, beside the work of calls.
   Returns false, with arena->refused, if there is no memory for them. */
bool arena_reserve(Arena *arena, size_t bytes);

static inline size_t arena_bytes(size_t count, size_t size) {
    return (count * size + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT;
}

/* The next `bytes` bytes of the arena, with undefined contents. */
static inline void *arena_take(Arena *arena, size_t bytes) {
    void *place = arena->next;
    arena->next += arena_bytes(bytes, 1);
    return place;
}

static inline ArenaMark arena_mark(Arena *arena) {
    return (ArenaMark){arena, arena->next, arena->block};
}

static inline void arena_release(ArenaMark mark) {
    if (mark.arena == NULL) {
        return;
    }
    mark.arena->next = mark.next;
    if (mark.arena->block != mark.block) {
        mark.arena->block = mark.block;
        mark.arena->end = mark.block->end;
    }
}

/* For a return: gives everything back and passes the result on. */
static inline bool arena_leave(ArenaMark mark, bool result) {
    arena_release(mark);
    return result;
}

#ifdef ARENA_ON_STACK
#define WORK_IS_SMALL(bytes) ((bytes) > 0)
/* Declares a pointer to a structure. */
#define WORK_OF(mark, type, name)                                                                                     \
    type name##_here;                                                                                                 \
    type *const name = ((void)(mark), &name##_here)
#else
#define WORK_IS_SMALL(bytes) ((bytes) <= SMALL_WORK)
#define WORK_OF(mark, type, name) type *const name = (type *)arena_take((mark).arena, sizeof(type))
#endif

/* The mark of a function whose largest array has `bytes` bytes, a constant. If all its arrays lie on the stack, there
   is nothing to give back. */
static inline ArenaMark arena_mark_of(Arena *arena, size_t bytes) {
    return WORK_IS_SMALL(bytes) ? (ArenaMark){NULL, NULL, NULL} : arena_mark(arena);
}

/* Declares name[count]; the count is a constant. */
#define WORK(mark, type, name, count)                                                                                 \
    type name##_small[WORK_IS_SMALL((count) * sizeof(type)) ? (count) : 1];                                           \
    type *const name = WORK_IS_SMALL((count) * sizeof(type)) ? name##_small                                           \
                                                             : (type *)arena_take((mark).arena, (count) * sizeof(type))

/* The same with zeros. */
#define WORK_ZEROS(mark, type, name, count)                                                                           \
    WORK(mark, type, name, count);                                                                                    \
    memset(name, 0, (count) * sizeof(type))

/* Declares name[rows][columns]. */
#define WORK_ROWS(mark, type, name, rows, columns)                                                                    \
    type name##_small[WORK_IS_SMALL(sizeof(type[rows][columns])) ? (rows) : 1][columns];                              \
    type(*const name)[columns] = WORK_IS_SMALL(sizeof(type[rows][columns]))                                           \
                                     ? name##_small                                                                   \
                                     : (type(*)[columns])arena_take((mark).arena, sizeof(type[rows][columns]))

#endif
