/* What a time step costs while many contacts are closed.

   usage: contacts STEP SETTLING STEPS. Integrates over SETTLING steps of STEP (s), then over STEPS more. Prints how
   many contacts are closed at the end, and the CPU time (us) of one of the latter steps. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <stdio.h>
#include <stdlib.h>

#include "fmi2Functions.h"
#include "host.h"
#include "mechanism.h"
#include "state.h"

static void run(fmi2Component unit, double start, double step, long steps) {
    for (long i = 0; i < steps; i++) {
        demand(fmi2DoStep(unit, start + (double)i * step, step, fmi2True) == fmi2OK, "fmi2DoStep");
    }
}

static int closed_contacts(fmi2Component unit) {
    int closed = 0;
    for (fmi2ValueReference i = 0; i < N_VARIABLES; i++) {
        fmi2Integer mode = MODE_OPEN;
        if (VARIABLES[i].kind == VARIABLE_MODE) {
            demand(fmi2GetInteger(unit, &i, 1, &mode) == fmi2OK, "fmi2GetInteger");
        }
        closed += mode != MODE_OPEN;
    }
    return closed;
}

int main(int count, char *arguments[]) {
    static fmi2CallbackFunctions callbacks;
    demand(count == 4, "usage");
    const double step = atof(arguments[1]);
    const long settling = atol(arguments[2]), steps = atol(arguments[3]);
    fmi2Component unit =
        fmi2Instantiate("contacts", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    demand(unit != NULL, "fmi2Instantiate");
    fmi2SetupExperiment(unit, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(unit);
    demand(fmi2ExitInitializationMode(unit) == fmi2OK, "fmi2ExitInitializationMode");
    run(unit, 0.0, step, settling);
    const double begin = now();
    run(unit, (double)settling * step, step, steps);
    printf("%d %.3f\n", closed_contacts(unit), 1e6 * (now() - begin) / (double)steps);
    return 0;
}
