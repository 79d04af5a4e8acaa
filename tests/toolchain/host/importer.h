/* An importer in C: loads the library of an FMU and drives it. What the files of this folder share. */
#ifndef IMPORTER_H
#define IMPORTER_H

#include <stddef.h>
#include <stdint.h>

#include "fmi2FunctionTypes.h"

#define FUNCTIONS_OF_FMI(F)                                                                                     \
    F(GetTypesPlatform) F(GetVersion) F(SetDebugLogging) F(Instantiate) F(FreeInstance) F(SetupExperiment)      \
    F(EnterInitializationMode) F(ExitInitializationMode) F(Terminate) F(Reset) F(GetReal) F(GetInteger)         \
    F(GetBoolean) F(GetString) F(SetReal) F(SetInteger) F(SetBoolean) F(SetString) F(GetFMUstate)               \
    F(SetFMUstate) F(FreeFMUstate) F(SerializedFMUstateSize) F(SerializeFMUstate) F(DeSerializeFMUstate)        \
    F(GetDirectionalDerivative) F(EnterEventMode) F(NewDiscreteStates) F(EnterContinuousTimeMode)               \
    F(CompletedIntegratorStep) F(SetTime) F(SetContinuousStates) F(GetDerivatives) F(GetEventIndicators)        \
    F(GetContinuousStates) F(GetNominalsOfContinuousStates) F(SetRealInputDerivatives)                          \
    F(GetRealOutputDerivatives) F(DoStep) F(CancelStep) F(GetStatus) F(GetRealStatus) F(GetIntegerStatus)       \
    F(GetBooleanStatus) F(GetStringStatus)

enum { MAX_VARIABLES = 512, MAX_STATES = 64, MAX_BYTES = 32768 };

typedef struct {
    fmi2ValueReference reference;
    char kind; /* t time, x state that is an output, l other state, u input, p tunable, f fixed, y output, d derivative of
                  a state, c calculated, j Real that jumps at events only, n Integer */
    double start, minimum, maximum;
} Variable;

#define MEMBER(name) fmi2##name##TYPE *name;
typedef struct {
    FUNCTIONS_OF_FMI(MEMBER)
    char guid[64];
    int constraints; /* start values may be refused, because they must meet them */
    size_t states;   /* of model exchange */
    size_t indicators; /* of events: there are contacts, switches or dry friction */
    int variables;
    Variable variable[MAX_VARIABLES];
} Fmu;
#undef MEMBER

/* Loads a library and the description beside it, as the tests write it; ends the program with a message if it can't. */
void load(Fmu *fmu, const char *library, const char *description);

/* What a logger received; one for each instance, passed as componentEnvironment. */
typedef struct {
    int count; /* of messages with another status than fmi2OK */
    fmi2Status status;
    char text[2048];
} Log;

/* Callbacks that write to the log. */
fmi2CallbackFunctions callbacks_to(Log *log);

/* A new instance: in state "instantiated"; initialized from time 0, in continuous-time mode or step complete. */
fmi2Component instantiate(const Fmu *fmu, fmi2Type type, Log *log);
fmi2Component start(const Fmu *fmu, fmi2Type type, Log *log);

/* The serialized state of an instance, at most MAX_BYTES; returns its size. */
size_t serialize(const Fmu *fmu, fmi2Component c, fmi2Byte bytes[]);

/* The references of the variables of these kinds; returns their number. */
size_t references_of(const Fmu *fmu, const char *kinds, fmi2ValueReference references[]);

/* Ends the program with exit status 1 and this message unless the condition holds. */
void expect(int condition, const char *format, ...);

/* What can be done with an FMU: life.c, threads.c, motion.c, random_calls.c. */
void cycles(const Fmu *fmu, int count);
void threads(const Fmu *fmu, int count);
void move(const Fmu *fmu);
void save(const Fmu *fmu, const char *path);
void go_on(const Fmu *fmu, const char *path);
void random_calls(const Fmu *fmu, int count, uint64_t seed);
void forge(const Fmu *fmu, int count);

/* Deliberate faults, to show that they would be found. */
void leak(const Fmu *fmu);
void overrun(const Fmu *fmu);
void race(const Fmu *fmu);

#endif
