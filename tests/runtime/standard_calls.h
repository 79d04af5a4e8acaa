/* Which function may be called in which state: the tables of FMI 2.0.5, sections 3.2.3 and 4.2.4, as data. They were
   typed a second time, from the rules of the project and the masks of Reference-FMUs, not copied from the runtime.

       x   legal, if only for debugging
       o   beyond the standard's tables, accepted with a note in category logAll
       .   illegal: fmi2Error

   The states: i instantiated, z initialization mode, e event mode, c continuous-time mode, s step complete, f step
   failed, t terminated, x error. Those of fmi2Pending and of fmi2Fatal do not occur. Functions for all types of
   variables have a row for each kind of variable: tunable parameters, parameters that are fixed, calculated ones. */
#ifndef STANDARD_CALLS_H
#define STANDARD_CALLS_H

#define MODEL_EXCHANGE_STATES "izectx"
#define CO_SIMULATION_STATES  "izsftx"

#define STANDARD_CALLS(CALL)                                  \
    /*                                 izectx    izsftx  */   \
    CALL(SetupExperiment,             "x.....", "x.....")     \
    CALL(SetDebugLogging,             "xxxxxx", "xxxxxx")     \
    CALL(EnterInitializationMode,     "x.....", "x.....")     \
    CALL(ExitInitializationMode,      ".x....", ".x....")     \
    CALL(Terminate,                   "..xx..", "..xx..")     \
    CALL(Reset,                       "xxxxxx", "xxxxxx")     \
    CALL(GetReal,                     "oxxxxx", "oxxxxx")     \
    CALL(SetReal_input,               "oxxx..", "oxx...")     \
    CALL(SetReal_state,               "xxxx..", "xx....")     \
    CALL(SetReal_tunable,             "xxxo..", "xxx...")     \
    CALL(SetReal_fixed,               "xx....", "xx....")     \
    CALL(SetReal_calculated,          "......", "......")     \
    CALL(GetInteger,                  "oxxxxx", "oxxxxx")     \
    CALL(GetBoolean,                  "oxxxxx", "oxxxxx")     \
    CALL(GetString,                   "oxxxxx", "oxxxxx")     \
    CALL(SetInteger,                  "xxx...", "xxx...")     \
    CALL(SetBoolean,                  "xxx...", "xxx...")     \
    CALL(SetString,                   "xxx...", "xxx...")     \
    CALL(GetFMUstate,                 "xxxxxx", "xxxxxx")     \
    CALL(SetFMUstate,                 "xxxxxx", "xxxxxx")     \
    CALL(FreeFMUstate,                "xxxxxx", "xxxxxx")     \
    CALL(SerializedFMUstateSize,      "xxxxxx", "xxxxxx")     \
    CALL(SerializeFMUstate,           "xxxxxx", "xxxxxx")     \
    CALL(DeSerializeFMUstate,         "xxxxxx", "xxxxxx")     \
    CALL(GetDirectionalDerivative,    ".xxx..", ".xx...")     \
    /* model exchange */                                      \
    CALL(EnterEventMode,              "..xx..", "......")     \
    CALL(NewDiscreteStates,           "..x...", "......")     \
    CALL(EnterContinuousTimeMode,     "..x...", "......")     \
    CALL(CompletedIntegratorStep,     "...x..", "......")     \
    CALL(SetTime,                     "...x..", "......")     \
    CALL(SetContinuousStates,         "...x..", "......")     \
    CALL(GetDerivatives,              ".xxxxx", "......")     \
    CALL(GetEventIndicators,          ".xxxxx", "......")     \
    CALL(GetContinuousStates,         ".xxxxx", "......")     \
    CALL(GetNominalsOfContinuousStates, "xxxxxx", "......")   \
    /* co-simulation */                                       \
    CALL(SetRealInputDerivatives,     "......", "xxx...")     \
    CALL(GetRealOutputDerivatives,    "......", ".oxxxx")     \
    CALL(DoStep,                      "......", "..x...")     \
    CALL(CancelStep,                  "......", "......")     \
    CALL(GetStatus,                   "......", "..xxx.")     \
    CALL(GetRealStatus,               "......", "..xxx.")     \
    CALL(GetIntegerStatus,            "......", "..xxx.")     \
    CALL(GetBooleanStatus,            "......", "..xxx.")     \
    CALL(GetStringStatus,             "......", "..xxx.")

#endif
