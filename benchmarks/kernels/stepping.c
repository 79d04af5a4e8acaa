/* Times fmi2DoStep of an FMU's sources against the evaluations of the equations that it makes.

   usage: stepping STEPS ROUNDS. Prints a line a round: ns of a communication step of 1 ms, ns of 4 evaluations. Both
   are measured in turn over STEPS communication steps, so that a machine that gets slower slows both. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"
#include "mechanism.h"

static const double STEP = 1e-3; /* s; equal to the solver step: one step of the Runge-Kutta method of 4 stages */

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* ns per communication step; *time is moved on. */
static double time_steps(fmi2Component c, int count, double *time) {
    fmi2Status status = fmi2OK;
    const double start = now();
    for (int i = 0; i < count; i++) {
        status = status == fmi2OK ? fmi2DoStep(c, *time, STEP, fmi2True) : status;
        *time += STEP;
    }
    const double elapsed = now() - start;
    if (status != fmi2OK) {
        exit(2);
    }
    return elapsed / count;
}

/* ns per 4 evaluations near the states x; each waits for the last one, as the stages of a method do. */
static double time_evaluations(double time, double x[], int count) {
    double qdd[N_COORDINATES], pivots[N_COORDINATES];
    const double start = now();
    for (int i = 0; i < 4 * count; i++) {
        mechanism_accelerations(time, x, START_INPUTS, START_PARAMETERS, qdd, pivots);
        const double change = 1e-12 * qdd[0];
        for (int k = 0; k < N_COORDINATES; k++) {
            x[k] += change;
        }
    }
    return (now() - start) / count;
}

/* The present states, by their value references. */
static void read_states(fmi2Component c, double x[]) {
    for (fmi2ValueReference i = 0; i < N_VARIABLES; i++) {
        if (VARIABLES[i].kind == VARIABLE_STATE) {
            fmi2GetReal(c, &i, 1, &x[VARIABLES[i].index]);
        }
    }
}

int main(int count, char *arguments[]) {
    fmi2CallbackFunctions callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    fmi2Component c = fmi2Instantiate("timed", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    if (count != 3 || c == NULL) {
        return 2;
    }
    const int steps = atoi(arguments[1]), rounds = atoi(arguments[2]);
    double time = 0.0, x[N_STATES];
    fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(c);
    fmi2ExitInitializationMode(c);
    for (int i = 0; i < rounds; i++) {
        const double step = time_steps(c, steps, &time);
        read_states(c, x);
        printf("%.3f %.3f\n", step, time_evaluations(time, x, steps));
    }
    fmi2FreeInstance(c);
    return 0;
}
