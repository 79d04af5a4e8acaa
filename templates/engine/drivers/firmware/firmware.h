/* The gate of programs without a standard of exchange: firmware, and any other program in C. All values are in SI
   units. Nothing is allocated, printed or waited for. The functions that a program calls have the names of its
   mechanism, and are made of these. */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include <stddef.h>

#include "arena_size.h"
#include "instance.h"
#include "variables.h"

typedef enum {
    FIRMWARE_OK,            /* done */
    FIRMWARE_NO_VARIABLE,   /* there is no such variable, or it cannot be set now, and nothing was set */
    FIRMWARE_NO_VALUE,      /* the value is not finite or outside the range of the variable, and nothing was set; or
                               the variable has no value at the present point */
    FIRMWARE_NOT_NOW,       /* the instance was not started, or was started before */
    FIRMWARE_NO_STEP,       /* the step is not positive, not a number or longer than the longest one; nothing moved */
    FIRMWARE_FAILED         /* the equations have no solution: the failure tells why. The instance stays at the last
                               completed step, and may go on from there with other inputs */
} FirmwareStatus;

typedef struct {
    Instance instance;
    double begun;  /* s; the time at which steps of the present length began */
    double length; /* s; of the last step */
    int32_t count; /* steps of this length since then */
    double time;   /* s; at the end of the last step */
} Firmware;

/* Bytes of memory that an instance needs, wherever they begin. */
#define FIRMWARE_SIZE (ARENA_UNIT - 1 + FIRMWARE_HEAD + ARENA_HEAD + ARENA_CAPACITY)
#define FIRMWARE_HEAD ((sizeof(Firmware) + ARENA_UNIT - 1) / ARENA_UNIT * ARENA_UNIT)

/* An instance in this memory, with all start values. NULL if the memory is too small. */
Firmware *firmware_init(void *memory, size_t size);

/* Gives a variable a value. Inputs and tunable parameters may be set at any time, states and fixed parameters before
   the start. */
FirmwareStatus firmware_set(Firmware *firmware, int variable, double value);

/* The value of a variable, which is not changed where it has none. What is calculated has none before the start. */
FirmwareStatus firmware_get(Firmware *firmware, int variable, double *value);

/* Begins at this time (s): solves for the start values that constraints determine, and decides modes of contacts. */
FirmwareStatus firmware_start(Firmware *firmware, double time);

/* Moves on by a step (s). The inputs hold throughout it. */
FirmwareStatus firmware_step(Firmware *firmware, double step);

/* s */
double firmware_time(const Firmware *firmware);

/* Why the last call failed, a FailureKind; and the NoticeKinds of all steps so far, as bits. */
int firmware_failure(const Firmware *firmware);
int firmware_notices(const Firmware *firmware);

#endif
