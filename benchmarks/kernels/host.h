/* What the programs that run an FMU's functions share: the time on the processor, and a way out. */
#ifndef HOST_H
#define HOST_H

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* The time on the processor so far, in s; the file defines _POSIX_C_SOURCE before it includes anything. */
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Ends the program with 2 and says what failed, unless it holds. */
static void demand(int holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "%s failed\n", what);
        exit(2);
    }
}

#endif
