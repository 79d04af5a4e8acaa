/* Running FMUs that are linked into this program: 20 steps of .1 s each, and then a line with the states. */
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#define RUN_FMI2(prefix, guid, states)                                                                                \
    {                                                                                                                 \
        extern fmi2InstantiateTYPE prefix##fmi2Instantiate;                                                           \
        extern fmi2EnterInitializationModeTYPE prefix##fmi2EnterInitializationMode;                                   \
        extern fmi2ExitInitializationModeTYPE prefix##fmi2ExitInitializationMode;                                     \
        extern fmi2DoStepTYPE prefix##fmi2DoStep;                                                                     \
        extern fmi2GetRealTYPE prefix##fmi2GetReal;                                                                   \
        fmi2CallbackFunctions callbacks;                                                                              \
        memset(&callbacks, 0, sizeof callbacks);                                                                      \
        fmi2Component it = prefix##fmi2Instantiate("it", fmi2CoSimulation, guid, NULL, &callbacks, 0, 0);             \
        prefix##fmi2EnterInitializationMode(it);                                                                      \
        prefix##fmi2ExitInitializationMode(it);                                                                       \
        for (int i = 0; i < 20; i++) {                                                                                \
            prefix##fmi2DoStep(it, 0.1 * i, 0.1, fmi2True);                                                           \
        }                                                                                                             \
        for (fmi2ValueReference i = 1; i <= states; i++) {                                                            \
            double value = 0.0;                                                                                       \
            prefix##fmi2GetReal(it, &i, 1, &value);                                                                   \
            printf("%.17g ", value);                                                                                  \
        }                                                                                                             \
        printf("\n");                                                                                                 \
    }

#define RUN_FMI3(prefix, token, states)                                                                               \
    {                                                                                                                 \
        extern fmi3InstantiateCoSimulationTYPE prefix##fmi3InstantiateCoSimulation;                                   \
        extern fmi3EnterInitializationModeTYPE prefix##fmi3EnterInitializationMode;                                   \
        extern fmi3ExitInitializationModeTYPE prefix##fmi3ExitInitializationMode;                                     \
        extern fmi3DoStepTYPE prefix##fmi3DoStep;                                                                     \
        extern fmi3GetFloat64TYPE prefix##fmi3GetFloat64;                                                             \
        bool event, end, early;                                                                                       \
        double last;                                                                                                  \
        fmi3Instance it = prefix##fmi3InstantiateCoSimulation("it", token, NULL, false, false, false, false, NULL, 0, \
                                                              NULL, NULL, NULL);                                      \
        prefix##fmi3EnterInitializationMode(it, false, 0.0, 0.0, false, 0.0);                                         \
        prefix##fmi3ExitInitializationMode(it);                                                                       \
        for (int i = 0; i < 20; i++) {                                                                                \
            prefix##fmi3DoStep(it, 0.1 * i, 0.1, true, &event, &end, &early, &last);                                  \
        }                                                                                                             \
        for (fmi3ValueReference i = 1; i <= states; i++) {                                                            \
            double value = 0.0;                                                                                       \
            prefix##fmi3GetFloat64(it, &i, 1, &value, 1);                                                             \
            printf("%.17g ", value);                                                                                  \
        }                                                                                                             \
        printf("\n");                                                                                                 \
    }
