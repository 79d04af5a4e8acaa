/* Runs an FMU of FMI 3.0 that it is linked with, and prints values with all bits.
   Arguments: token, CoSimulation or ModelExchange, length of a step (s), number of steps, number of variables. By
   co-simulation it prints the variables after each step; by model exchange, with steps of Euler's method and events at
   their ends, it prints states, derivatives before the step, and event indicators. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { MOST = 4096 };

static void must(fmi3Status status, const char *call) {
    if (status > fmi3Warning) {
        fprintf(stderr, "%s: status %d\n", call, (int)status);
        exit(1);
    }
}

static void print(const double *values, size_t count) {
    for (size_t i = 0; i < count; i++) {
        printf("%a ", values[i]);
    }
}

static void simulate(fmi3Instance fmu, double step, int steps, int variables) {
    fmi3Boolean event, end, early;
    fmi3Float64 last, value;
    for (int i = 0; i < steps; i++) {
        must(fmi3DoStep(fmu, i * step, step, fmi3True, &event, &end, &early, &last), "fmi3DoStep");
        for (fmi3ValueReference j = 0; j < (fmi3ValueReference)variables; j++) {
            must(fmi3GetFloat64(fmu, &j, 1, &value, 1), "fmi3GetFloat64");
            print(&value, 1);
        }
        printf("\n");
    }
}

static void settle(fmi3Instance fmu) {
    fmi3Boolean again = fmi3True, end, nominals, states, defined;
    fmi3Float64 next;
    while (again) {
        must(fmi3UpdateDiscreteStates(fmu, &again, &end, &nominals, &states, &defined, &next), "updating");
    }
    must(fmi3EnterContinuousTimeMode(fmu), "fmi3EnterContinuousTimeMode");
}

static void exchange(fmi3Instance fmu, double step, int steps) {
    static double x[MOST], rates[MOST], z[MOST], before[MOST];
    size_t n, m;
    must(fmi3GetNumberOfContinuousStates(fmu, &n), "fmi3GetNumberOfContinuousStates");
    must(fmi3GetNumberOfEventIndicators(fmu, &m), "fmi3GetNumberOfEventIndicators");
    settle(fmu);
    must(fmi3GetEventIndicators(fmu, before, m), "fmi3GetEventIndicators");
    for (int i = 0; i < steps; i++) {
        fmi3Boolean event, end;
        bool crossed = false;
        must(fmi3GetContinuousStates(fmu, x, n), "fmi3GetContinuousStates");
        must(fmi3GetContinuousStateDerivatives(fmu, rates, n), "fmi3GetContinuousStateDerivatives");
        for (size_t j = 0; j < n; j++) {
            x[j] += ((i + 1) * step - i * step) * rates[j];
        }
        must(fmi3SetTime(fmu, (i + 1) * step), "fmi3SetTime");
        must(fmi3SetContinuousStates(fmu, x, n), "fmi3SetContinuousStates");
        must(fmi3CompletedIntegratorStep(fmu, fmi3True, &event, &end), "fmi3CompletedIntegratorStep");
        must(fmi3GetEventIndicators(fmu, z, m), "fmi3GetEventIndicators");
        for (size_t j = 0; j < m; j++) {
            crossed = crossed || (z[j] > 0.0) != (before[j] > 0.0);
        }
        if (event || crossed) {
            must(fmi3EnterEventMode(fmu), "fmi3EnterEventMode");
            settle(fmu);
        }
        must(fmi3GetEventIndicators(fmu, before, m), "fmi3GetEventIndicators");
        must(fmi3GetContinuousStates(fmu, x, n), "fmi3GetContinuousStates");
        print(x, n);
        print(rates, n);
        print(z, m);
        printf("\n");
    }
}

int main(int count, char **words) {
    const bool steps = count == 6 && strcmp(words[2], "CoSimulation") == 0;
    fmi3Instance fmu = NULL;
    if (count != 6) {
        return 2;
    }
    if (steps) {
        fmu = fmi3InstantiateCoSimulation("static", words[1], "", fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0,
                                          NULL, NULL, NULL);
    } else {
        fmu = fmi3InstantiateModelExchange("static", words[1], "", fmi3False, fmi3False, NULL, NULL);
    }
    if (fmu == NULL) {
        return 1;
    }
    must(fmi3EnterInitializationMode(fmu, fmi3False, 0.0, 0.0, fmi3False, 0.0), "fmi3EnterInitializationMode");
    must(fmi3ExitInitializationMode(fmu), "fmi3ExitInitializationMode");
    if (steps) {
        simulate(fmu, atof(words[3]), atoi(words[4]), atoi(words[5]));
    } else {
        exchange(fmu, atof(words[3]), atoi(words[4]));
    }
    fmi3FreeInstance(fmu);
    return 0;
}
