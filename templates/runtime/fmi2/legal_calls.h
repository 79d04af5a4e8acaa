/* Which function may be called when: the state machines of FMI 2.0, sections 3.2.3 and 4.2.4, as one table.

   A column is a mode of the instance, a row is a function, so that a row can be held against the row of the standard:

       x   legal
       d   legal for debugging only (the values may be of little use)
       o   beyond the standard's table, but importers do it and it is harmless: accepted, noted once in category logAll
       .   illegal: fmi2Error

   Compiled from the masks in Reference-FMUs, src/fmi2Functions.c, and from stricter notes on FMI 2.0.5: fmi2SetTime is
   illegal in event mode (it is for purely discrete FMUs), fmi2GetDirectionalDerivative after the end.

   The modes stepInProgress, stepCanceled and fatal do not occur: fmi2DoStep returns when the step is done. */
#ifndef LEGAL_CALLS_H
#define LEGAL_CALLS_H

#include "fmi2Functions.h"
#include "variables.h"

/*            i  instantiated
              z  initialization mode
              e  event mode               c  continuous-time mode
              s  step complete            f  step failed
              t  terminated
              x  error                    model exchange   co-simulation
                                           i z e c t x      i z s f t x  */
#define FMI2_CALLS(CALL)                                                      \
    CALL(SetDebugLogging,                 "x x x x x x",   "x x x x x x")     \
    CALL(SetupExperiment,                 "x . . . . .",   "x . . . . .")     \
    CALL(EnterInitializationMode,         "x . . . . .",   "x . . . . .")     \
    CALL(ExitInitializationMode,          ". x . . . .",   ". x . . . .")     \
    CALL(Terminate,                       ". . x x . .",   ". . x x . .")     \
    CALL(Reset,                           "x x x x x x",   "x x x x x x")     \
    CALL(GetReal,                         "o x x x x d",   "o x x d x d")     \
    CALL(GetInteger,                      "o x x x x d",   "o x x d x d")     \
    CALL(GetBoolean,                      "o x x x x d",   "o x x d x d")     \
    CALL(GetString,                       "o x x x x d",   "o x x d x d")     \
    CALL(SetReal,                         "x x x x . .",   "x x x . . .")     \
    CALL(SetInteger,                      "x x x . . .",   "x x x . . .")     \
    CALL(SetBoolean,                      "x x x . . .",   "x x x . . .")     \
    CALL(SetString,                       "x x x . . .",   "x x x . . .")     \
    CALL(GetFMUstate,                     "x x x x x d",   "x x x d x d")     \
    CALL(SetFMUstate,                     "x x x x x x",   "x x x x x x")     \
    CALL(FreeFMUstate,                    "x x x x x x",   "x x x x x x")     \
    CALL(SerializedFMUstateSize,          "x x x x x x",   "x x x x x x")     \
    CALL(SerializeFMUstate,               "x x x x x x",   "x x x x x x")     \
    CALL(DeSerializeFMUstate,             "x x x x x x",   "x x x x x x")     \
    CALL(GetDirectionalDerivative,        ". x x x . .",   ". x x . . .")     \
    /* model exchange */                                                      \
    CALL(EnterEventMode,                  ". . x x . .",   ". . . . . .")     \
    CALL(NewDiscreteStates,               ". . x . . .",   ". . . . . .")     \
    CALL(EnterContinuousTimeMode,         ". . x . . .",   ". . . . . .")     \
    CALL(CompletedIntegratorStep,         ". . . x . .",   ". . . . . .")     \
    CALL(SetTime,                         ". . . x . .",   ". . . . . .")     \
    CALL(SetContinuousStates,             ". . . x . .",   ". . . . . .")     \
    CALL(GetDerivatives,                  ". x x x x d",   ". . . . . .")     \
    CALL(GetEventIndicators,              ". x x x x d",   ". . . . . .")     \
    CALL(GetContinuousStates,             ". x x x x d",   ". . . . . .")     \
    CALL(GetNominalsOfContinuousStates,   "x x x x x d",   ". . . . . .")     \
    /* co-simulation */                                                       \
    CALL(SetRealInputDerivatives,         ". . . . . .",   "x x x . . .")     \
    CALL(GetRealOutputDerivatives,        ". . . . . .",   ". o x d x d")     \
    CALL(DoStep,                          ". . . . . .",   ". . x . . .")     \
    CALL(CancelStep,                      ". . . . . .",   ". . . . . .")     \
    CALL(GetStatus,                       ". . . . . .",   ". . x x x .")     \
    CALL(GetRealStatus,                   ". . . . . .",   ". . x x x .")     \
    CALL(GetIntegerStatus,                ". . . . . .",   ". . x x x .")     \
    CALL(GetBooleanStatus,                ". . . . . .",   ". . x x x .")     \
    CALL(GetStringStatus,                 ". . . . . .",   ". . x x x .")

#define CALL_NUMBER(name, model_exchange, co_simulation) CALL_##name,
typedef enum { FMI2_CALLS(CALL_NUMBER) N_CALLS } Call;
#undef CALL_NUMBER

typedef enum {
    MODE_INSTANTIATED,
    MODE_INITIALIZATION,
    MODE_EVENT,
    MODE_CONTINUOUS_TIME,
    MODE_STEP_COMPLETE,
    MODE_STEP_FAILED,
    MODE_TERMINATED,
    MODE_ERROR,
    N_MODES
} Mode;

typedef enum { VERDICT_ILLEGAL = '.', VERDICT_LEGAL = 'x', VERDICT_DEBUG = 'd', VERDICT_TOLERATED = 'o' } Verdict;

/* May this function be called for an instance of this type in this mode? */
Verdict legal_call(Call call, fmi2Type type, Mode mode);

/* May fmi2SetReal set a variable of this kind in this mode? */
Verdict legal_set(VariableKind kind, fmi2Type type, Mode mode);

/* Can fmi2SetReal set a variable of this kind in any mode at all? */
int ever_settable(VariableKind kind, fmi2Type type);

/* "fmi2SetReal" */
const char *call_name(Call call);

/* "initialization mode" */
const char *mode_name(Mode mode);

/* Writes the modes where the call is legal as "event mode, continuous-time mode"; empty if there are none. */
void legal_modes(Call call, fmi2Type type, char text[], size_t size);

#endif
