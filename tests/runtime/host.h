/* A small importer in C, linked statically with the runtime: what the check files share. */
#ifndef HOST_H
#define HOST_H

#include <stddef.h>

#include "fmi2Functions.h"

/* Value references of tests/runtime/double_pendulum/mechanism.c. */
enum {
    TIME, THETA1, THETA2, THETA1_DOT, THETA2_DOT, THETA1_DDOT, THETA2_DDOT, Q_THETA1, Q_THETA2,
    M1, M2, L1, L2, G, SOLVER_TOLERANCE, SOLVER_STEP, SOLVER_MAX_STEP, REACH,
    KINETIC_ENERGY, POTENTIAL_ENERGY, TOTAL_ENERGY, P_THETA1, P_THETA2, EXTERNAL_POWER, X_TIP_DDOT,
    N_REFERENCES
};

enum { SNAPSHOT_SIZE = 4096 };

/* What the logger received; one for each instance, passed as componentEnvironment. */
typedef struct {
    int count;
    fmi2Status status;
    char name[64];
    char category[64];
    char message[2048]; /* as it came, a format */
    char text[2048];    /* with its arguments */
} Log;

/* Counts a check and reports it with file and line if it does not hold. */
#define CHECK(expression) check((expression) != 0, #expression, __FILE__, __LINE__)
void check(int holds, const char *expression, const char *file, int line);

/* The number of failed checks so far; prints a summary. */
int summary(void);

/* Did the log's last message contain this? */
int said(const Log *log, const char *words);

/* Callbacks that write to the log. */
fmi2CallbackFunctions callbacks_to(Log *log);

/* A new instance in state "instantiated", logging to log (all categories). */
fmi2Component instantiate(fmi2Type type, Log *log);

/* A new instance, initialized from time 0 without stop time, with start values; in continuous-time mode or step
   complete. */
fmi2Component start(fmi2Type type, Log *log);

/* One Real variable. get returns NaN unless the status is fmi2OK. */
double get(fmi2Component c, fmi2ValueReference reference);
fmi2Status set(fmi2Component c, fmi2ValueReference reference, double value);

/* Communication steps of equal length (s) from time on; the worst status. */
fmi2Status steps(fmi2Component c, double time, double length, int count);

/* The serialized state of an instance: writes at most SNAPSHOT_SIZE bytes, returns their number. */
size_t snapshot(fmi2Component c, fmi2Byte bytes[]);

/* Do two instances have the same serialized state, bit for bit? */
int same_state(fmi2Component a, fmi2Component b);

#endif
