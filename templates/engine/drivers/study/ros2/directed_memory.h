/* What directions need beside their stages in steps of ROS2: nothing. */
#ifndef DIRECTED_MEMORY_H
#define DIRECTED_MEMORY_H

enum { STEPS_HOLD_SAMPLES = 0 }; /* steps end at samples, as they do at communication points */

typedef struct {
    int none; /* C has no struct without members */
} DirectedMemory;

#endif
