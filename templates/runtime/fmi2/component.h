/* What FMI 2.0 adds to an instance of the mechanism. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include "instance.h"
#include "legal_calls.h"

/* What changes with calls and is saved with the State: int64_t only, so that there is no padding. */
typedef struct {
    int64_t type;               /* fmi2Type; a saved session fits instances of the same type only */
    int64_t mode;               /* Mode of the state machine */
    int64_t experiment_defined; /* fmi2SetupExperiment was called */
    int64_t step_failed;        /* the last fmi2DoStep returned fmi2Discard */
} Session;

/* The memory that an fmi2Component points to. */
typedef struct {
    Instance instance;
    Session session;
    fmi2Type type;
    fmi2CallbackFunctions callbacks;
    bool logging_requested;             /* loggingOn of fmi2Instantiate */
    unsigned categories;                /* bit i: Category i is logged */
    Call call;                          /* the fmi2 function being executed, for messages */
    bool noted_calls[N_CALLS];          /* tolerated calls are noted once */
    bool noted_kinds[N_VARIABLE_KINDS]; /* tolerated settings of variables are noted once */
    bool noted_singularity;             /* the warning of a mass matrix that becomes singular was given */
    char name[];                        /* instanceName, a copy */
} Component;

/* Changes the mode, and the phase of the instance with it. */
static inline void set_mode(Component *component, Mode mode) {
    component->session.mode = mode;
    component->instance.state.phase = mode == MODE_INSTANTIATED     ? PHASE_SETTING_UP
                                      : mode == MODE_INITIALIZATION ? PHASE_SOLVING_START
                                                                    : PHASE_RUNNING;
}

#endif
