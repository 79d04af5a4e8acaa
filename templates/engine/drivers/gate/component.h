/* What FMI adds to an instance of the mechanism. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include "instance.h"
#include "legal_calls.h"

/* The memory that the importer's handle points to. */
typedef struct {
    Instance instance;
    Session session;
    InterfaceType type;
    Importer importer;
    Seed seed;                          /* with the next ones: what derivatives are asked for, within one call */
    Tangent tangent;
    Motion motion;
    bool logging_requested;             /* loggingOn of the instantiation */
    unsigned categories;                /* bit i: Category i is logged */
    Call call;                          /* the function being executed, for messages */
    bool noted_calls[N_CALLS];          /* tolerated calls are noted once */
    bool noted_kinds[N_VARIABLE_KINDS]; /* tolerated settings of variables are noted once */
    bool noted_singularity;             /* the warning of a mass matrix that becomes singular was given */
    bool logging;                       /* the importer's logger runs, which must not call functions of the FMU */
    const char *called_back;            /* the function that it called nevertheless, or NULL */
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
