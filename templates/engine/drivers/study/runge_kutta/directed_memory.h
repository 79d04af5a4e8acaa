/* What directions need beside their stages in steps of an explicit Runge-Kutta method: nothing. */
#ifndef DIRECTED_MEMORY_H
#define DIRECTED_MEMORY_H

enum { STEPS_HOLD_SAMPLES = 1 }; /* samples within steps follow by the interpolant */

typedef struct {
    int none; /* C has no struct without members */
} DirectedMemory;

#endif
