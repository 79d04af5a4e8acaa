/* Energy over a long run of an FMU.

   usage: long SETTING VALUE PERIOD SAMPLES PERIODS. Sets the parameter SETTING to VALUE and integrates from 0 over
   PERIODS times PERIOD (s). Wherever 1, 2 or 5 times a power of ten periods are full, prints their number, the greatest
   relative error of the energy at SAMPLES equidistant times in each of the last periods, and the CPU time (s) that a
   period without samples has taken so far. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "host.h"
#include "mechanism.h"

enum { WINDOW = 10 /* periods with samples */ };

static fmi2ValueReference reference_of(const char *name) {
    for (fmi2ValueReference i = 0; i < N_VARIABLES; i++) {
        if (strcmp(VARIABLES[i].name, name) == 0) {
            return i;
        }
    }
    demand(0, name);
    return 0;
}

typedef struct {
    fmi2Component unit;
    double time, spent; /* s; in the motion, and on the processor for ... */
    long whole;         /* ... that many periods without samples */
} Run;

static void step(Run *run, double length) {
    demand(fmi2DoStep(run->unit, run->time, length, fmi2True) == fmi2OK, "fmi2DoStep");
    run->time += length;
}

static double energy_of(const Run *run) {
    const fmi2ValueReference reference = reference_of("total_energy");
    double energy;
    demand(fmi2GetReal(run->unit, &reference, 1, &energy) == fmi2OK, "fmi2GetReal");
    return energy;
}

/* The greatest relative error in some periods with samples. */
static double watch(Run *run, double energy, double period, long periods, long samples) {
    double greatest = 0.0;
    for (long i = 0; i < periods * samples; i++) {
        step(run, period / (double)samples);
        greatest = fmax(greatest, fabs(energy_of(run) / energy - 1.0));
    }
    return greatest;
}

int main(int count, char *arguments[]) {
    static fmi2CallbackFunctions callbacks;
    demand(count == 6, "usage");
    const double value = atof(arguments[2]), period = atof(arguments[3]);
    const long samples = atol(arguments[4]), periods = atol(arguments[5]);
    const fmi2ValueReference setting = reference_of(arguments[1]);
    fmi2Component unit = fmi2Instantiate("long", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    demand(unit != NULL, "fmi2Instantiate");
    Run run = {unit, 0.0, 0.0, 0};
    demand(fmi2SetReal(run.unit, &setting, 1, &value) == fmi2OK, "fmi2SetReal");
    fmi2SetupExperiment(run.unit, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(run.unit);
    demand(fmi2ExitInitializationMode(run.unit) == fmi2OK, "fmi2ExitInitializationMode");
    const double energy = energy_of(&run);
    long done = 0;
    for (long decade = 1; decade <= periods; decade *= 10) {
        for (const int *multiple = (const int[]){1, 2, 5, 0}; *multiple > 0; multiple++) {
            if (*multiple * decade > periods) {
                break;
            }
            const long ahead = *multiple * decade - done, watched = ahead < WINDOW ? ahead : WINDOW;
            const double begin = now();
            for (long i = 0; i < ahead - watched; i++) {
                step(&run, period);
            }
            run.spent += now() - begin;
            run.whole += ahead - watched;
            const double error = watch(&run, energy, period, watched, samples);
            done += ahead;
            printf("%ld %.3e %.3e\n", done, error, run.spent / (double)(run.whole > 0 ? run.whole : 1));
            fflush(stdout);
        }
    }
    return 0;
}
