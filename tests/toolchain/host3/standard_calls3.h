/* Which function may be called in which state: the tables of FMI 3.0, sections 2.3, 3.2 and 4.2, as data. They were
   typed a second time, from the text of the standard, not copied from the runtime.

       x   legal, if only for debugging
       o   beyond the standard's tables, accepted with a note in category logAll
       .   illegal: fmi3Error

   The states: i instantiated, z initialization mode, e event mode, c continuous-time mode, s step mode, t terminated,
   x terminated by an error. Calls in intermediate update mode are those of the callback in random_calls3.c. */
#ifndef STANDARD_CALLS3_H
#define STANDARD_CALLS3_H

#define MODEL_EXCHANGE_STATES "izectx"
#define CO_SIMULATION_STATES  "izestx"

#define STANDARD_CALLS(CALL)                                          \
    /*                                         izectx    izestx  */   \
    CALL(SetDebugLogging,                     "xxxxxx", "xxxxxx")     \
    CALL(EnterInitializationMode,             "x.....", "x.....")     \
    CALL(ExitInitializationMode,              ".x....", ".x....")     \
    CALL(EnterEventMode,                      "...x..", "...x..")     \
    CALL(Terminate,                           "..xx..", "..xx..")     \
    CALL(Reset,                               "xxxxxx", "xxxxxx")     \
    CALL(GetFloat64,                          "xxxxxx", "xxxxxx")     \
    CALL(GetInt32,                            "xxxxxx", "xxxxxx")     \
    CALL(GetInt64,                            "xxxxxx", "xxxxxx")     \
    CALL(GetClock,                            ".xx...", ".xx...")     \
    CALL(GetOther,                            "xxxxxx", "xxxxxx")     \
    CALL(SetFloat64_input,                    "xxxx..", "xxxx..")     \
    CALL(SetFloat64_state,                    "xxxx..", "xx....")     \
    CALL(SetFloat64_tunable,                  "xxxo..", "xxxx..")     \
    CALL(SetFloat64_fixed,                    "xx....", "xx....")     \
    CALL(SetFloat64_calculated,               "......", "......")     \
    CALL(SetInt32,                            "xxx...", "xxxx..")     \
    CALL(SetInt64,                            "xxx...", "xxxx..")     \
    CALL(SetOther,                            "xxx...", "xxxx..")     \
    CALL(SetClock,                            "..x...", "..x...")     \
    CALL(GetFMUState,                         "xxxxxx", "xxxxxx")     \
    CALL(SetFMUState,                         "xxxxxx", "xxxxxx")     \
    CALL(FreeFMUState,                        "xxxxxx", "xxxxxx")     \
    CALL(SerializedFMUStateSize,              "xxxxxx", "xxxxxx")     \
    CALL(SerializeFMUState,                   "xxxxxx", "xxxxxx")     \
    CALL(DeserializeFMUState,                 "xxxxxx", "xxxxxx")     \
    CALL(GetDirectionalDerivative,            ".xxxxx", ".xxxxx")     \
    CALL(GetAdjointDerivative,                ".xxxxx", ".xxxxx")     \
    CALL(GetNumberOfVariableDependencies,     "xxxxxx", "xxxxxx")     \
    CALL(GetVariableDependencies,             "xxxxxx", "xxxxxx")     \
    CALL(EnterConfigurationMode,              "......", "......")     \
    CALL(ExitConfigurationMode,               "......", "......")     \
    CALL(EvaluateDiscreteStates,              "......", "......")     \
    CALL(ActivateModelPartition,              "......", "......")     \
    CALL(GetInterval,                         ".xx...", ".xx...")     \
    CALL(SetInterval,                         ".xx...", ".xx...")     \
    CALL(SetShift,                            ".x....", ".x....")     \
    CALL(UpdateDiscreteStates,                "..x...", "..x...")     \
    CALL(EnterContinuousTimeMode,             "..x...", "......")     \
    CALL(CompletedIntegratorStep,             "...x..", "......")     \
    CALL(SetTime,                             "...x..", "......")     \
    CALL(SetContinuousStates,                 "...x..", "......")     \
    CALL(GetContinuousStateDerivatives,       ".xxxxx", "......")     \
    CALL(GetEventIndicators,                  ".xxxxx", "......")     \
    CALL(GetContinuousStates,                 ".xxxxx", "......")     \
    CALL(GetNominalsOfContinuousStates,       "oxxxxx", "......")     \
    CALL(GetNumberOfEventIndicators,          "xoxoox", "......")     \
    CALL(GetNumberOfContinuousStates,         "xoxoox", "......")     \
    CALL(EnterStepMode,                       "......", "..x...")     \
    CALL(GetOutputDerivatives,                "......", ".ooxxx")     \
    CALL(DoStep,                              "......", "...x..")

#endif
