/* One instance of the mechanism: everything that belongs to it is in this struct, and nothing in it belongs to a
   standard of exchange. The gate of the FMU wraps it.

   The State is what an importer saves. All else is either given at instantiation and never changed, or can be computed
   again from the State, so that a run continued from a restored State repeats bit for bit. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>

#include "arena.h"
#include "constraint_records.h"
#include "linear_solve.h"
#include "mechanism.h"
#include "policy.h"
#include "state.h"

/* The factorised system behind the accelerations, see system.h. */
typedef struct {
    Arena *arena;               /* for the work of solving it */
    bool dense;                 /* M is factorised in pivoted, not in factor */
    double factor[SIZE_FACTOR]; /* by generated code */
    Factorization pivoted;      /* densely */
    double weight[SIZE_CONSTRAINTS];
    ConstraintFactorization constraints;
    double forcing[N_COORDINATES];  /* f of M qdd = f + G^T multiplier; under constraints only */
    double gamma[SIZE_CONSTRAINTS]; /* gamma of G qdd + gamma = 0 */
} System;

/* A direction in the space of the knowns: of time, states, inputs and parameters. */
typedef struct {
    double time;
    double states[N_STATES];
    double inputs[N_SIGNALS];
    double parameters[SIZE_PARAMETERS];
    double settings[N_SETTINGS]; /* of the solver, on which no unknown depends */
} Seed;

/* The derivatives along a Seed. */
typedef struct {
    double accelerations[N_UNKNOWNS]; /* with those of the multipliers behind them */
    double further[SIZE_FURTHER];     /* of the derivatives of further states */
    double dependent[SIZE_DEPENDENT];
    double locals[SIZE_LOCALS];
} Tangent;

/* The motion at the present point: q and its time derivatives, (order of derivative, coordinate), and the first and
   second time derivatives of further states and of the locals (of these the second ones of outputs only). */
typedef struct {
    double q[3 + MAX_OUTPUT_ORDER][N_UNKNOWNS]; /* from the second order on the multipliers stand behind */
    double further[MAX_OUTPUT_ORDER][SIZE_FURTHER];
    double locals[MAX_OUTPUT_ORDER][SIZE_LOCALS];
} Motion;

/* Values that follow from the State, each with a flag whether they do at present. */
typedef struct {
    bool states_behind; /* the states in the State are of an earlier time; integrator_catch_up brings them on */
    bool dependent_valid, least_pivots_valid, accelerations_valid, locals_valid, system_valid, indicators_valid;
    bool shown_valid;
    double dependent[SIZE_DEPENDENT];
    double accelerations[N_UNKNOWNS]; /* with the multipliers behind them, those of redundant constraints being 0 */
    double reported[N_UNKNOWNS];      /* accelerations, with the multipliers of least norm behind them */
    double shown[N_UNKNOWNS];         /* the same with multipliers that obey the laws of contacts; read from outside */
    double further[SIZE_FURTHER];     /* derivatives of further states; valid with the accelerations */
    double locals[SIZE_LOCALS];
    double indicators[SIZE_EVENTS];     /* of events, see events.h */
    double least_pivots[N_COORDINATES]; /* of the generated solution of M qdd = f; smaller ones are suspicious */
    System system;                      /* at the present point, for tangents */
} Cache;

/* Of the loads that contacts and dry frictions share, event functions are those of least norm, or those that stay
   farthest within the laws, which cost more. LOADS_BY_MARGIN takes the first ones where they are far from the limits
   of the laws, else the second ones. */
typedef enum { LOADS_BY_MARGIN, LOADS_LEAST, LOADS_CENTRED } ShownLoads;

/* Memory that is written before it is read, within one call. */
typedef struct {
    double mass[N_COORDINATES * N_COORDINATES]; /* lower triangle */
    double forcing[N_COORDINATES];
    System system;                 /* at a stage of the solver */
    double usual[N_COORDINATES];   /* accelerations to go on with where a constraint is about to be lost */
    double stage_states[N_STATES];
    double unprojected[N_STATES];  /* the result of a trial step, before it is brought onto the constraints */
    double new_states[N_STATES];   /* the result of a trial step */
    double new_derivatives[N_STATES];
    bool derivatives_late; /* those are not at the end of the step, but near it */
    double trial_length;           /* s; of that step */
    SolverScratch solver;
    ObserverScratch observer;
    SolverMemory solver_before;    /* the solver's memory when the trial step began, if there are events */
    bool inputs_move;              /* some input is not constant in the running communication step */
    double step_start;             /* s; the time at which the running communication step began */
    double step_end;               /* s; the time at which it ends, if no event comes before */
    int64_t events_passed;         /* the events passed in this communication step */
    bool loads_shared;             /* some evaluation of event functions in this step shared loads */
    double inputs[3 * N_INPUTS];   /* at a stage of the solver, with their first and second derivatives */
} Scratch;

typedef enum {
    FAILURE_NONE,
    FAILURE_SINGULAR,        /* the mass matrix determines no acceleration of the flagged coordinates */
    FAILURE_NEARLY_SINGULAR, /* the mass matrix hardly determines the acceleration of the flagged coordinates */
    FAILURE_NOT_FINITE,      /* the accelerations of the flagged coordinates are not finite */
    FAILURE_FURTHER,         /* the derivative of a further state is not finite */
    FAILURE_TABLE,           /* an argument is outside its table */
    FAILURE_OVERFLOW,        /* a state left the range of double */
    FAILURE_ACCURACY,        /* the error of a state exceeds the tolerance however short the step */
    FAILURE_TRIAL_COUNT,     /* an adaptive method took too many steps */
    FAILURE_KINK,            /* behind a kink of constraints the velocities meet them no longer */
    FAILURE_STANDSTILL,      /* many steps of an adaptive method hardly took the time on */
    FAILURE_EVENT_COUNT,     /* a communication step met too many events */
    FAILURE_STEP_COUNT,      /* a fixed-step method would need too many steps */
    FAILURE_ITERATION,       /* the equations of an implicit step were not solved */
    FAILURE_CONSTRAINTS,     /* no states were found that meet the constraints */
    FAILURE_SLIDING,         /* no forces of sliding friction were found */
    FAILURE_RESTITUTION,     /* the coefficient of restitution of a contact is not between 0 and 1 */
    FAILURE_FRICTION,        /* the coefficient of friction of a contact is negative */
    FAILURE_PUSHING,         /* the force of a dry friction is negative */
    FAILURE_PENETRATION,     /* the start leaves a gap negative */
    FAILURE_JUMP,            /* a switch makes a gap negative */
    FAILURE_MODES,           /* no modes were found that obey the laws of contact */
    FAILURE_MEMORY,          /* there is no memory for the laws of what touches */
    FAILURE_MASSLESS,        /* the flagged coordinates, which have no mass, do not follow from the others */
    FAILURE_EVENT_VALUE,     /* an event function has no finite value */
    FAILURE_EVENT_POLE,      /* an event function grows beyond all bounds */
    FAILURE_CHATTERING,      /* the events at one time have no end */
    FAILURE_ESTIMATE,        /* the equations have no value at an estimate, or no state near it meets the constraints */
    FAILURE_SAMPLE_TIME,     /* a communication step is longer than the time between samples */
    FAILURE_PAST             /* more communication points are in the longest delay than are kept */
} FailureKind;

/* Why the last evaluation or solver step failed; failure_sentence.h puts it in words. */
typedef struct {
    FailureKind kind;
    double time;                     /* s */
    bool coordinates[N_COORDINATES]; /* for SINGULAR, NOT_FINITE and MASSLESS: the coordinates concerned */
    int state;                       /* for OVERFLOW and ACCURACY: the worst state; for FURTHER: the state; for TABLE:
                                        the index of the argument in ARGUMENTS */
    double amount;                   /* for ACCURACY: error in units of the tolerance; for the COUNTs: steps; for
                                        FURTHER: the derivative; for TABLE: the value of the argument; for
                                        MEMORY: bytes; for SAMPLE_TIME: the time between samples, s */
    double step;                     /* for OVERFLOW and ACCURACY: length of the trial step, s; for STANDSTILL:
                                        the time that the steps took, s; for SAMPLE_TIME: the communication step */
    int count;                       /* for CONSTRAINTS and MASSLESS: the number of constraints that are not met */
    int constraints[SIZE_CONSTRAINTS];  /* for CONSTRAINTS and MASSLESS: the indices of these constraints */
    double residuals[SIZE_CONSTRAINTS]; /* for CONSTRAINTS and MASSLESS: the residuals of these constraints */
    bool flat;                          /* for CONSTRAINTS: what is missed has hardly any slope at these states */
    bool imported;                      /* for CONSTRAINTS and NOT_FINITE: the importer's solver made the states */
    int event;                          /* for EVENT_VALUE and CHATTERING: the index of the event function; for
                                           STANDSTILL: of the last one that came down to 0, or -1 */
} Failure;

/* What the importer should know about a step that was completed. */
typedef enum {
    NOTICE_NONE = 0,
    NOTICE_STIFF = 1,   /* the steps of an explicit method are bounded by its stability */
    NOTICE_UNEQUAL = 2, /* the steps of a variational method are not of the same length any more */
    NOTICE_UNRESOLVED = 4, /* steps do not resolve an undamped vibration: the method damps it or misses it */
    NOTICE_MOTION = 8,  /* of a motion input only the position moves */
    NOTICE_RANGE = 16,  /* a coordinate left its range */
    NOTICE_NO_FORCES = 32, /* a contact could not bear its sliding friction (Painleve's paradox) */
    NOTICE_POISSON = 64, /* Newton's law would have made the energy grow in an impact */
    NOTICE_CLOSED = 128, /* the rounds of an impact had no end */
    NOTICE_REDUCED = 256, /* the restitution of an impact was reduced, or the energy would have grown */
    NOTICE_TWO_SOLUTIONS = 512, /* the laws of contact allow two motions (Painleve's paradox) */
    NOTICE_UNSOLVED = 1024 /* the laws of contact were not met in a step, which had too little work, or no solution */
} NoticeKind;

/* notice_sentence.h puts it in words. */
typedef struct {
    NoticeKind kind;
    double time; /* s */
    double step; /* length of the solver step, s */
    int index;   /* for MOTION: the index of the motion; for RANGE: the index in BOUNDED */
} Notice;

enum { MOST_NOTICES = 10 + SIZE_BOUNDED }; /* each kind is given once, that of ranges once for each coordinate */

/* The longest message, with its end; what is longer is cut. */
enum { SENTENCE_SIZE = 1024 };

/* The gate: it may hear that a given start was moved, and follow communication steps. */
typedef struct {
    void (*start_moved)(void *owner, int state, double given, double taken); /* where given start values missed the
                                                  constraints by little: the state (by index) that was moved
                                                  furthest, before and after. May be NULL */
    double (*follow)(void *owner, double end); /* called at the end of each solver step, with the end (s) of the
                                                  communication step; returns its new end (s), no later. May be NULL */
    bool awaits_events; /* a communication step ends at the first event; integrator_settle passes it */
    void *owner;
} Listener;

typedef struct {
    State state;
    Cache cache;
    Scratch scratch;
    ShownLoads shown_loads; /* LOADS_BY_MARGIN but while events are searched for in a step */
    Failure failure;
    Notice notices[MOST_NOTICES]; /* those given in the last step of the importer */
    int n_notices;
    const Policy *policy;
    Listener listener;
    Arena *arena; /* for work within one call */
} Instance;

/* Gives an instance its arena, of ARENA_CAPACITY (arena_size.h). Whoever makes the instance does so before all else,
   and ends the arena with the instance. */
void instance_work_in(Instance *instance, Arena *arena);

/* Gives an instance all start values, in the phase of setting up; the policy and the listener stay. */
void instance_start(Instance *instance);

/* Writes a double of the State (time, a state, an input, a parameter; SI) and marks everything that depends on it as
   outdated. Writing the same bits again changes nothing, so that a solver may go on with its stored derivative. */
void instance_assign(Instance *instance, double *slot, double value);

/* Marks all values outside the State as outdated. */
void instance_forget_cache(Instance *instance);

/* Marks the values outside the State as outdated that depend on time, states or inputs. */
void instance_forget_motion(Instance *instance);

#endif
