/* The variables of the FMU as data: what each value reference stands for.

   mechanism.h is generated and includes this header; the table VARIABLES itself is in the generated mechanism.c. */
#ifndef VARIABLES_H
#define VARIABLES_H

typedef enum {
    VARIABLE_TIME,         /* the independent variable, s */
    VARIABLE_STATE,        /* x = [q_1..q_n, qd_1..qd_n, z_1..] */
    VARIABLE_MASSLESS,     /* an entry of x that follows from the others, because it has no mass */
    VARIABLE_ACCELERATION, /* qdd[n], the derivatives of the states n..2n-1 */
    VARIABLE_FURTHER_RATE, /* dz/dt of the further states */
    VARIABLE_MULTIPLIER,   /* of a constraint */
    VARIABLE_INPUT,        /* u, external forces and prescribed motions */
    VARIABLE_PARAMETER,    /* p, independent and tunable */
    VARIABLE_FIXED_PARAMETER, /* p, in a constraint */
    VARIABLE_SETTING,      /* fixed parameters of the solver, see Setting */
    VARIABLE_DEPENDENT,    /* c(p), the calculatedParameters of FMI */
    VARIABLE_LOCAL,        /* y(t, x, u, p, qdd): energies, momenta, outputs of the user */
    VARIABLE_MODE,         /* ElementMode of a contact, stop or dry friction; an enumeration */
    VARIABLE_IMPACTS,      /* number of impacts of a contact or stop so far; an integer */
    VARIABLE_IMPULSE,      /* of its last impact */
    VARIABLE_INDICATOR,    /* of an event; the solver of the importer stops where one comes down to 0 */
    VARIABLE_CLOCK,        /* of a contact or stop: ticks at its impacts */
    VARIABLE_ESTIMATE,     /* a parameter that an observer estimates */
    VARIABLE_SAMPLE,       /* what was measured, and whether it counts: inputs of an observer */
    VARIABLE_TUNING,       /* the noise of an observer's samples and process, tunable */
    VARIABLE_FIXED_TUNING, /* how well an observer's start is known, and its sample times */
    VARIABLE_BELIEF,       /* what an observer tells beside the estimate */
    N_VARIABLE_KINDS
} VariableKind;

/* One variable: its name in modelDescription.xml, its kind, its index in the vector of that kind, the range that
   the importer may set (-HUGE_VAL, HUGE_VAL where there is no bound), and whether it is an output. */
typedef struct {
    const char *name;
    VariableKind kind;
    int index;
    double minimum, maximum;
    int output;
} Variable;

/* The vector of kind VARIABLE_SETTING; 0 means "chosen automatically" for each of them. */
typedef enum {
    SETTING_TOLERANCE, /* relative tolerance of the adaptive methods */
    SETTING_STEP,      /* s; first step of the adaptive methods, the step of the fixed-step methods */
    SETTING_MAX_STEP,  /* s; no solver step is longer */
    N_SETTINGS
} Setting;

#endif
