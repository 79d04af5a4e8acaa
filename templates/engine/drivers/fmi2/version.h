/* What the gate has to know of FMI 2.0: types, modes, and which function may be called when, which are the state
   machines of sections 3.2.3 and 4.2.4 as one table, see call_rows.h.

   Compiled from the masks in Reference-FMUs, src/fmi2Functions.c, and from stricter notes on FMI 2.0.5: fmi2SetTime is
   illegal in event mode (it is for purely discrete FMUs), fmi2GetDirectionalDerivative after the end.

   The modes stepInProgress, stepCanceled and fatal do not occur: fmi2DoStep returns when the step is done. */
#ifndef VERSION_H
#define VERSION_H

#include <stdbool.h>
#include <stdint.h>

#include "call_rows.h"
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
    CALL(FreeInstance,                    "x x x x x x",   "x x x x x x")     \
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

extern const CallRow CALLS[N_CALLS];
extern const CallRow SETTABLE[N_VARIABLE_KINDS]; /* what fmi2SetReal may set */
extern const ModeColumns MODE_COLUMNS[N_MODES];

/* Names of functions, for sentences. */
#define INSTANTIATE "fmi2Instantiate"
#define GET_STATE "fmi2GetFMUstate"
#define DESERIALIZE_STATE "fmi2DeSerializeFMUstate"
#define SERIALIZE_STATE "fmi2SerializeFMUstate"
#define SERIALIZED_STATE_SIZE "fmi2SerializedFMUstateSize"
#define EXIT_INITIALIZATION "fmi2ExitInitializationMode"
#define CHANGES_TIME "fmi2DoStep or fmi2SetTime"

typedef fmi2Status Status;
#define STATUS_OK fmi2OK
#define STATUS_WARNING fmi2Warning
#define STATUS_DISCARD fmi2Discard
#define STATUS_ERROR fmi2Error

typedef fmi2ValueReference Reference;

/* The importer's side of an instance. */
typedef fmi2CallbackFunctions Importer;

/* What changes with calls and is saved with the State: int64_t only, so that there is no padding. */
typedef struct {
    int64_t type;               /* InterfaceType; a saved session fits instances of the same type only */
    int64_t mode;               /* Mode of the state machine */
    int64_t experiment_defined; /* fmi2SetupExperiment was called */
    int64_t step_failed;        /* the last fmi2DoStep returned fmi2Discard */
} Session;

/* The mode that tells which calls are legal. */
static inline Mode mode_of_calls(const Importer *importer, const Session *session) {
    (void)importer; /* has no callback that may call the FMU */
    return (Mode)session->mode;
}

/* What a message doubles: #r1# would mean a variable, and a message is a format of printf. It needs no arguments: a
   logger in C#, Java or Python cannot take them, and showed the format alone. */
#define DOUBLED "#%"

/* Hands a message, with what it doubles doubled, to the importer's logger, if it has one. */
void deliver(const Importer *importer, const char *name, Status status, const char *category, const char *text);

/* Is a message of this status delivered with logging off, too? Errors are, and what is said of a step's results. */
static inline bool told_always(Status status, Call call) {
    return status == fmi2Error ||
           (status != fmi2OK && (call == CALL_DoStep || call == CALL_CompletedIntegratorStep ||
                                 call == CALL_NewDiscreteStates));
}

#endif
