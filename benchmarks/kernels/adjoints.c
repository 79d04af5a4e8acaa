/* Times derivatives of an FMU's sources against an evaluation of everything that is calculated.

   usage: adjoints COUNT ROUNDS. Prints a line a round, ns of: an evaluation of accelerations and locals; that and an
   adjoint of all unknowns at a point where nothing is known yet; a further adjoint there; a further tangent. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "adjoint.h"
#include "component.h"
#include "equations.h"
#include "fmi2Functions.h"

static double sum; /* of all results, so that none is left out */

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void expect(bool success) {
    if (!success) {
        exit(2);
    }
}

static void evaluate(Instance *instance) {
    expect(equations_locals(instance));
    equations_dependent(instance);
    sum += instance->cache.accelerations[0];
}

static void adjoint(Instance *instance) {
    Tangent weights;
    Seed sensitivity;
    memset(&sensitivity, 0, sizeof sensitivity);
    double *values = (double *)&weights;
    for (size_t i = 0; i < sizeof weights / sizeof *values; i++) {
        values[i] = 1.0;
    }
    expect(equations_adjoint(instance, &weights, &sensitivity));
    sum += sensitivity.states[0];
}

static void tangent(Instance *instance) {
    Tangent found;
    Seed seed;
    double *values = (double *)&seed;
    for (size_t i = 0; i < sizeof seed / sizeof *values; i++) {
        values[i] = 1.0;
    }
    expect(equations_settle_seed(instance, &seed));
    equations_dependent_tangent(instance, &seed, &found);
    expect(equations_tangent(instance, &seed, &found));
    sum += found.accelerations[0];
}

/* ns of each of these calls; fresh: as if the point were another one each time. */
static double timed(Instance *instance, void (*call)(Instance *), bool fresh, int count) {
    const double start = now();
    for (int i = 0; i < count; i++) {
        if (fresh) {
            instance_forget_cache(instance);
            instance->state.states[0] += 1e-15;
        }
        call(instance);
    }
    return (now() - start) / count;
}

int main(int count, char *arguments[]) {
    fmi2CallbackFunctions callbacks;
    memset(&callbacks, 0, sizeof callbacks);
    fmi2Component c = fmi2Instantiate("timed", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    expect(count == 3 && c != NULL);
    const int calls = atoi(arguments[1]), rounds = atoi(arguments[2]);
    Instance *instance = &((Component *)c)->instance;
    fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(c);
    fmi2ExitInitializationMode(c);
    for (int i = 0; i < rounds; i++) {
        const double evaluation = timed(instance, evaluate, true, calls);
        const double first = timed(instance, adjoint, true, calls), more = timed(instance, adjoint, false, calls);
        printf("%.1f %.1f %.1f %.1f\n", evaluation, first, more, timed(instance, tangent, false, calls));
    }
    fmi2FreeInstance(c);
    return sum < 0.0 || sum >= 0.0 ? 0 : 3;
}
