/* What the gate has to know of FMI 3.0: types, modes, and which function may be called when, which are the state
   machines of sections 2.3, 3.2 and 4.2 as one table, see call_rows.h.

   After an error an instance is in the state Terminated of the standard, under the name "terminated by an error": its
   values serve for debugging only. Of Configuration Mode and Reconfiguration Mode there is nothing, because there are
   no structural parameters, and fmi3EvaluateDiscreteStates is not offered. */
#ifndef VERSION_H
#define VERSION_H

#include <stdbool.h>
#include <stdint.h>

#include "call_rows.h"
#include "event_sizes.h"
#include "fmi3Functions.h"
#include "ports.h"

/*            i  instantiated             c  continuous-time mode
              z  initialization mode      s  step mode
              e  event mode               u  intermediate update mode
              t  terminated
              x  terminated by an error   model exchange   co-simulation
                                           i z e c t x      i z e s u t x  */
#define FMI3_CALLS(CALL)                                                        \
    CALL(SetDebugLogging,                 "x x x x x x",   "x x x x x x x")     \
    CALL(EnterInitializationMode,         "x . . . . .",   "x . . . . . .")     \
    CALL(ExitInitializationMode,          ". x . . . .",   ". x . . . . .")     \
    CALL(EnterEventMode,                  ". . . x . .",   ". . . x . . .")     \
    CALL(Terminate,                       ". . x x . .",   ". . x x . . .")     \
    CALL(Reset,                           "x x x x x x",   "x x x x . x x")     \
    CALL(FreeInstance,                    "x x x x x x",   "x x x x . x x")     \
    CALL(GetFloat64,                      "x x x x x d",   "x x x x x x d")     \
    CALL(GetInt32,                        "x x x x x d",   "x x x x x x d")     \
    CALL(GetInt64,                        "x x x x x d",   "x x x x x x d")     \
    CALL(GetClock,                        ". x x . . .",   ". x x . . . .")     \
    CALL(SetFloat64,                      "x x x x . .",   "x x x x x . .")     \
    CALL(SetInt32,                        "x x x . . .",   "x x x x . . .")     \
    CALL(SetInt64,                        "x x x . . .",   "x x x x . . .")     \
    CALL(SetClock,                        ". . x . . .",   ". . x . . . .")     \
    CALL(GetFMUState,                     "x x x x x d",   "x x x x x x d")     \
    CALL(SetFMUState,                     "x x x x x x",   "x x x x . x x")     \
    CALL(FreeFMUState,                    "x x x x x x",   "x x x x x x x")     \
    CALL(SerializedFMUStateSize,          "x x x x x x",   "x x x x x x x")     \
    CALL(SerializeFMUState,               "x x x x x x",   "x x x x x x x")     \
    CALL(DeserializeFMUState,             "x x x x x x",   "x x x x x x x")     \
    CALL(GetDirectionalDerivative,        ". x x x x d",   ". x x x . x d")     \
    CALL(GetAdjointDerivative,            ". x x x x d",   ". x x x . x d")     \
    CALL(GetNumberOfVariableDependencies, "x x x x x x",   "x x x x x x x")     \
    CALL(GetVariableDependencies,         "x x x x x x",   "x x x x x x x")     \
    CALL(EnterConfigurationMode,          ". . . . . .",   ". . . . . . .")     \
    CALL(ExitConfigurationMode,           ". . . . . .",   ". . . . . . .")     \
    CALL(UpdateDiscreteStates,            ". . x . . .",   ". . x . . . .")     \
    CALL(EvaluateDiscreteStates,          ". . . . . .",   ". . . . . . .")     \
    /* types that no variable has, and clocks that are not triggered */         \
    CALL(GetFloat32,                      "x x x x x d",   "x x x x x x d")     \
    CALL(GetInt8,                         "x x x x x d",   "x x x x x x d")     \
    CALL(GetUInt8,                        "x x x x x d",   "x x x x x x d")     \
    CALL(GetInt16,                        "x x x x x d",   "x x x x x x d")     \
    CALL(GetUInt16,                       "x x x x x d",   "x x x x x x d")     \
    CALL(GetUInt32,                       "x x x x x d",   "x x x x x x d")     \
    CALL(GetUInt64,                       "x x x x x d",   "x x x x x x d")     \
    CALL(GetBoolean,                      "x x x x x d",   "x x x x x x d")     \
    CALL(GetString,                       "x x x x x d",   "x x x x x x d")     \
    CALL(GetBinary,                       "x x x x x d",   "x x x x x x d")     \
    CALL(SetFloat32,                      "x x x x . .",   "x x x x x . .")     \
    CALL(SetInt8,                         "x x x . . .",   "x x x x . . .")     \
    CALL(SetUInt8,                        "x x x . . .",   "x x x x . . .")     \
    CALL(SetInt16,                        "x x x . . .",   "x x x x . . .")     \
    CALL(SetUInt16,                       "x x x . . .",   "x x x x . . .")     \
    CALL(SetUInt32,                       "x x x . . .",   "x x x x . . .")     \
    CALL(SetUInt64,                       "x x x . . .",   "x x x x . . .")     \
    CALL(SetBoolean,                      "x x x . . .",   "x x x x . . .")     \
    CALL(SetString,                       "x x x . . .",   "x x x x . . .")     \
    CALL(SetBinary,                       "x x x . . .",   "x x x x . . .")     \
    CALL(GetIntervalDecimal,              ". x x . . .",   ". x x . . . .")     \
    CALL(GetIntervalFraction,             ". x x . . .",   ". x x . . . .")     \
    CALL(GetShiftDecimal,                 ". x x . . .",   ". x x . . . .")     \
    CALL(GetShiftFraction,                ". x x . . .",   ". x x . . . .")     \
    CALL(SetIntervalDecimal,              ". x x . . .",   ". x x . . . .")     \
    CALL(SetIntervalFraction,             ". x x . . .",   ". x x . . . .")     \
    CALL(SetShiftDecimal,                 ". x . . . .",   ". x . . . . .")     \
    CALL(SetShiftFraction,                ". x . . . .",   ". x . . . . .")     \
    /* model exchange */                                                        \
    CALL(EnterContinuousTimeMode,         ". . x . . .",   ". . . . . . .")     \
    CALL(CompletedIntegratorStep,         ". . . x . .",   ". . . . . . .")     \
    CALL(SetTime,                         ". . . x . .",   ". . . . . . .")     \
    CALL(SetContinuousStates,             ". . . x . .",   ". . . . . . .")     \
    CALL(GetContinuousStateDerivatives,   ". x x x x d",   ". . . . . . .")     \
    CALL(GetEventIndicators,              ". x x x x d",   ". . . . . . .")     \
    CALL(GetContinuousStates,             ". x x x x d",   ". . . . . . .")     \
    CALL(GetNominalsOfContinuousStates,   "o x x x x d",   ". . . . . . .")     \
    CALL(GetNumberOfEventIndicators,      "x o x o o d",   ". . . . . . .")     \
    CALL(GetNumberOfContinuousStates,     "x o x o o d",   ". . . . . . .")     \
    /* co-simulation */                                                         \
    CALL(EnterStepMode,                   ". . . . . .",   ". . x . . . .")     \
    CALL(GetOutputDerivatives,            ". . . . . .",   ". o o x x x d")     \
    CALL(DoStep,                          ". . . . . .",   ". . . x . . .")     \
    /* scheduled execution */                                                   \
    CALL(ActivateModelPartition,          ". . . . . .",   ". . . . . . .")

#define CALL_NUMBER(name, model_exchange, co_simulation) CALL_##name,
typedef enum { FMI3_CALLS(CALL_NUMBER) N_CALLS } Call;
#undef CALL_NUMBER

typedef enum {
    MODE_INSTANTIATED,
    MODE_INITIALIZATION,
    MODE_EVENT,
    MODE_CONTINUOUS_TIME,
    MODE_STEP,
    MODE_INTERMEDIATE_UPDATE,
    MODE_TERMINATED,
    MODE_ERROR,
    N_MODES
} Mode;

extern const CallRow CALLS[N_CALLS];
extern const CallRow SETTABLE[N_VARIABLE_KINDS]; /* what fmi3SetFloat64 may set */
extern const ModeColumns MODE_COLUMNS[N_MODES];

/* Names of functions, for sentences. */
#define INSTANTIATE "fmi3Instantiate"
#define GET_STATE "fmi3GetFMUState"
#define DESERIALIZE_STATE "fmi3DeserializeFMUState"
#define SERIALIZE_STATE "fmi3SerializeFMUState"
#define SERIALIZED_STATE_SIZE "fmi3SerializedFMUStateSize"
#define EXIT_INITIALIZATION "fmi3ExitInitializationMode"
#define CHANGES_TIME "fmi3DoStep or fmi3SetTime"

typedef fmi3Status Status;
#define STATUS_OK fmi3OK
#define STATUS_WARNING fmi3Warning
#define STATUS_DISCARD fmi3Discard
#define STATUS_ERROR fmi3Error

/* The importer's side of an instance. */
typedef struct {
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log_message;
    fmi3IntermediateUpdateCallback intermediate_update;
    bool event_mode_used;
    bool early_return_allowed;
    bool intermediate[N_PORTS]; /* what it reads and sets in intermediate update mode */
    bool sets_inputs;           /* there are inputs among these */
    bool updating;              /* its callback runs, which is an intermediate update */
    bool may_get, may_set;      /* in the running intermediate update */
} Importer;

/* What changes with calls and is saved with the State: int64_t only, so that there is no padding. */
typedef struct {
    int64_t type;          /* InterfaceType; a saved session fits instances of the same type only */
    int64_t mode;          /* Mode of the state machine */
    int64_t reinitialized; /* continuous states were changed in the present event */
    int64_t counted[SIZE_UNILATERALS]; /* impacts of each contact up to the last fmi3UpdateDiscreteStates */
    int64_t ticking[SIZE_UNILATERALS]; /* the clock of the contact is active: it had one of them in that */
} Session;

/* The mode that tells which calls are legal. As long as a callback of the importer runs these are the ones of
   intermediate update mode, also after an error in it: the step that called back must find its instance. */
static inline Mode mode_of_calls(const Importer *importer, const Session *session) {
    return importer->updating ? MODE_INTERMEDIATE_UPDATE : (Mode)session->mode;
}

/* What a message doubles: #1# would mean a variable. */
#define DOUBLED "#"

/* Hands a message, with what it doubles doubled, to the importer's logger, if it has one. */
void deliver(const Importer *importer, const char *name, Status status, const char *category, const char *text);

/* Is a message of this status delivered with logging off, too? Errors are; nothing else may be. */
static inline bool told_always(Status status, Call call) {
    (void)call;
    return status == fmi3Error;
}

#endif
