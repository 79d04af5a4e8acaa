/* The memory of an FMU that observes nothing. */
#ifndef OBSERVER_MEMORY_H
#define OBSERVER_MEMORY_H

#include <stdbool.h>

enum { OBSERVES = 0 };

typedef struct {
    double slots[1];
} ObserverMemory;

typedef struct {
    double unused;
} ObserverScratch;

static inline void observer_memory_start(ObserverMemory *memory) {
    memory->slots[0] = 0.0;
}

static inline bool observer_memory_in_range(const ObserverMemory *memory) {
    (void)memory;
    return true;
}

#endif
