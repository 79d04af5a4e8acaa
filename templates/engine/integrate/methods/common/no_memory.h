/* The memory of a method that remembers nothing from step to step. */
#ifndef NO_MEMORY_H
#define NO_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

#include "changes.h"

typedef struct {
    int64_t none; /* C has no struct without members */
} SolverMemory;

static inline void solver_forget(SolverMemory *memory, Change change) {
    (void)memory;
    (void)change;
}

#endif
