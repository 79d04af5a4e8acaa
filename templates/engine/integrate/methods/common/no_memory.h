/* The memory of a method that remembers nothing from step to step. */
#ifndef NO_MEMORY_H
#define NO_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int64_t none; /* C has no struct without members */
} SolverMemory;

static inline void solver_forget(SolverMemory *memory, bool motion) {
    (void)memory;
    (void)motion;
}

#endif
