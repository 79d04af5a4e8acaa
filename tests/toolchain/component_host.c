/* Runs an FMU of FMI 3.0 that it is linked with, by co-simulation, and prints values with all bits.
   Arguments: token, length of a step (s), number of steps, number of variables. */
#include <stdio.h>
#include <stdlib.h>

#include "fmi3Functions.h"

int main(int count, char **words) {
    fmi3Boolean event, end, early;
    fmi3Float64 last, value;
    const double step = count == 5 ? atof(words[2]) : 0.0;
    fmi3Instance fmu = fmi3InstantiateCoSimulation("static", words[1], "", fmi3False, fmi3False, fmi3False, fmi3False,
                                                   NULL, 0, NULL, NULL, NULL);
    if (fmu == NULL || fmi3EnterInitializationMode(fmu, fmi3False, 0.0, 0.0, fmi3False, 0.0) != fmi3OK ||
        fmi3ExitInitializationMode(fmu) != fmi3OK) {
        return 1;
    }
    for (int i = 0; i < atoi(words[3]); i++) {
        if (fmi3DoStep(fmu, i * step, step, fmi3True, &event, &end, &early, &last) > fmi3Warning) {
            return 1;
        }
        for (fmi3ValueReference j = 0; j < (fmi3ValueReference)atoi(words[4]); j++) {
            if (fmi3GetFloat64(fmu, &j, 1, &value, 1) != fmi3OK) {
                return 1;
            }
            printf("%a ", value);
        }
        printf("\n");
    }
    fmi3FreeInstance(fmu);
    return 0;
}
