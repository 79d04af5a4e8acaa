/* One instance of the FMU: everything that belongs to it is in this struct, in one block of memory.

   State is what fmi2GetFMUstate saves. All else is either given at instantiation and never changed, or can be computed
   again from the State, so that a run continued from a restored State repeats bit for bit.

   In all headers n = N_COORDINATES, m = N_CONSTRAINTS, h = N_HOLONOMIC. Unless it is said otherwise states are [q, qd],
   [2n], derivatives their rates, inputs [N_INPUTS], unknowns qdd[n] with the multipliers[m] behind them. Everything is
   in SI units, times and lengths of steps in s. Matrices are row-major. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>
#include <stdint.h>

#include "fmi2Functions.h"
#include "legal_calls.h"
#include "linear_solve.h"
#include "mechanism.h"
#if N_CONSTRAINTS > 0
#include "constraint_factorization.h"
#endif

#define N_UNKNOWNS (N_COORDINATES + N_CONSTRAINTS)                    /* accelerations and multipliers */
#define N_RESIDUALS (N_UNKNOWNS + N_CONSTRAINTS + N_HOLONOMIC) /* and the constraints' velocities and positions */

enum { HERMITE_TERMS = 3, DENSE_TERMS = HERMITE_TERMS + DENSE_ROWS };
enum { FIRST_MOTION = N_INPUTS - 3 * N_MOTIONS };   /* among the inputs */
enum { MAX_INPUT_ORDER = 3, MAX_OUTPUT_ORDER = 2 }; /* the highest time derivatives taken and given */

/* The last solver step, if it went beyond the end of the communication step, see dense_output.h. */
typedef struct {
    double start, end, rate; /* s; 1 / its length */
    double states[N_STATES]; /* at its start, ... */
    double end_states[N_STATES];
    double terms[DENSE_TERMS][N_STATES];
} Dense;

#if VARIATIONAL
/* What a variational integrator carries along: the momenta dL/dqd at the present point, and what rounding cut off from
   the sums of coordinates and momenta. */
typedef struct {
    double momenta[N_COORDINATES];
    double rest_coordinates[N_COORDINATES];
    double rest_momenta[N_COORDINATES];
    int64_t valid; /* nothing was changed since but ... */
    int64_t moved; /* ... motion inputs: the velocities do not belong to the momenta yet */
} Canonical;
#endif

#if FULLY_IMPLICIT
/* What a fully implicit solver carries along. None of it has to fit: it makes the iterations short. */
typedef struct {
    int64_t linearized;                              /* there are: */
    double stiffness[N_COORDINATES * N_COORDINATES]; /* dqdd/dq, row-major, ... */
    double damping[N_COORDINATES * N_COORDINATES];   /* ... and dqdd/dqd, at a point passed */
    double contraction;                              /* of the last iterations with them */
    double start, end, length;                       /* s; of the last step that was solved; length 0: there was none */
    double accelerations[STAGES * N_COORDINATES];    /* at its stages, ... */
    double start_accelerations[N_COORDINATES];       /* ... and, as the equations say, at its start and ... */
    double end_accelerations[N_COORDINATES];         /* ... at its end */
} Memory;
#endif

/* What changes with time. Members are double and int64_t only and there are no pointers: the layout is the same in
   32 and 64 bits, without padding, and a plain copy is a complete copy. */
typedef struct {
    int64_t type; /* fmi2Type; a saved State fits instances of the same type only */
    int64_t mode; /* Mode of the state machine */

    double time;       /* s; in co-simulation also the last successful time */
    double start_time; /* s, of fmi2SetupExperiment */
    double stop_time;  /* s, valid if stop_time_defined */
    int64_t stop_time_defined;
    int64_t experiment_defined; /* fmi2SetupExperiment was called */
    int64_t step_failed;        /* the last fmi2DoStep returned fmi2Discard */
    int64_t settled;            /* the states meet the constraints at the start; what has no mass follows from the
                                   present states proper */
#if N_MASSLESS > 0
    double massless[2][N_MASSLESS]; /* its positions and velocities at the last completed step */
    int64_t displaced;              /* inputs or parameters were changed in the present event */
#endif
#if N_CONSTRAINTS > 0
    int64_t rows_known;
    IndependentRows rows; /* found at the start, if rows_known */
    int64_t usual_known;  /* in model exchange: */
    double usual_time;    /* s; of the last completed step, with */
    double usual[1 + MAX_OUTPUT_ORDER][N_COORDINATES]; /* accelerations and their time derivatives there */
#endif
    double tolerance;           /* of fmi2SetupExperiment; 0 if it gave none */

    double states[N_STATES]; /* [q, qd] */
    double inputs[(2 + MAX_INPUT_ORDER) * N_INPUTS]; /* and behind them their derivatives by time of order 1, 2, 3 at the
                                                        present time, and zeros */
    int64_t input_derivatives_set; /* for the next communication step; else they are those of the end of the last one */
    double parameters[SIZE_PARAMETERS];
    double settings[N_SETTINGS]; /* by Setting */

    double next_step;             /* s; proposal for the next solver step, 0 before the first one */
    double previous_log_error;    /* ln of the error of the last full step in tolerances, for the PI controller */
    int64_t steps;                /* accepted so far; of them, in the present series of suspicious ones: */
    int64_t stiff_steps;          /* as long as stability allows, ... */
    int64_t easy_steps;           /* ... and shorter */
    double equal_step;            /* s; of a variational method: the length of all steps so far, 0 before the first */
    int64_t noticed;              /* Notices that were given, as bits: each is given once */
#if N_MOTIONS > 0
    double positions[N_MOTIONS]; /* of motions at the end of the last communication step */
    int64_t lone_moves;          /* communication steps in which only a position was moved */
#endif
    int64_t first_stage_valid;    /* first_stage belongs to the present time, states, inputs and parameters, or ... */
    int64_t ahead;                /* ... to the end of the step in dense: there the solver goes on */
    int64_t undisturbed;          /* nothing was changed since the end of the last communication step */
    double first_stage[N_STATES]; /* dx/dt */
#if VARIATIONAL
    Canonical canonical;
#endif
#if FULLY_IMPLICIT
    Memory memory;
#endif
    Dense dense;
} State;

/* The factorised system behind the accelerations, see system.h. */
typedef struct {
    bool dense;                 /* M is factorised in ... */
    double factor[SIZE_FACTOR]; /* ... generated code, or ... */
    Factorization pivoted;      /* ... densely */
#if N_CONSTRAINTS > 0
    double weight[N_CONSTRAINTS];
    ConstraintFactorization constraints;
    double forcing[N_COORDINATES]; /* and what the generated code gives along with it */
    double gamma[N_CONSTRAINTS];
#endif
} System;

/* Values that follow from the State, each with a flag whether they do at present. */
typedef struct {
    bool states_behind; /* those in the State are of an earlier time: integrator_catch_up */
    bool dependent_valid, least_pivots_valid, accelerations_valid, locals_valid, system_valid;
    double dependent[SIZE_DEPENDENT];
    double accelerations[N_UNKNOWNS]; /* and the multipliers behind them, those of redundant constraints being 0 */
    double reported[N_UNKNOWNS];      /* the same with multipliers of least norm */
    double locals[SIZE_LOCALS];
    double least_pivots[N_COORDINATES]; /* of the generated solution of M qdd = f; smaller ones are suspicious */
    System system;                      /* at the present point, for tangents */
} Cache;

#if FULLY_IMPLICIT
/* The linearized equations of an implicit step, row-major. */
typedef struct {
    double real_matrix[N_COORDINATES * N_COORDINATES]; /* of the real mode of the stages, ... */
    double pair_matrix[4 * N_COORDINATES * N_COORDINATES]; /* ... of its complex pair */
    int real_rows[N_COORDINATES];
    int pair_rows[2 * N_COORDINATES];
    double errors[2][N_STATES]; /* estimates */
} Implicit;
#endif

/* Memory that is written before it is read, within one call. */
typedef struct {
    double mass[N_COORDINATES * N_COORDINATES]; /* lower triangle, row-major */
    double forcing[N_COORDINATES];
    System system;                              /* at a stage of the solver */
    double usual[N_COORDINATES];                /* accelerations to go on with where a constraint is about to be lost */
    double stages[STAGES][N_STATES];            /* dx/dt at the stages of a trial step and of dense output */
    double stage_states[N_STATES];
    double new_states[N_STATES]; /* the result of a trial step */
    double new_derivatives[N_STATES];
    double trial_length; /* of that step, s */
#if FULLY_IMPLICIT
    Implicit implicit;
#endif
    double jacobian[SIZE_JACOBIAN]; /* of linearly implicit solvers: equations_jacobian, ... */
    double matrix[SIZE_JACOBIAN];   /* ... the matrix of their systems, ... */
    double missed;                  /* ... and what the linearization missed of the last step, see solver_stiffness */
    bool inputs_move;        /* some input is not constant in the running communication step, ... */
    double step_start;       /* ... which began at this time, s */
    double inputs[3 * N_INPUTS]; /* at a stage of the solver, with their first and second derivatives */
} Scratch;

typedef enum {
    FAILURE_NONE,
    FAILURE_SINGULAR,   /* the mass matrix determines no acceleration of the flagged coordinates */
    FAILURE_NEARLY_SINGULAR, /* of these it hardly does; none yet, but it will become one */
    FAILURE_NOT_FINITE, /* the accelerations of the flagged coordinates are not finite */
    FAILURE_OVERFLOW,   /* a state left the range of double */
    FAILURE_ACCURACY,   /* the error of a state exceeds the tolerance however short the step */
    FAILURE_TRIAL_COUNT, /* an adaptive method took too many steps */
    FAILURE_STEP_COUNT, /* a fixed-step method would need too many steps */
    FAILURE_ITERATION,  /* the equations of an implicit step were not solved */
    FAILURE_CONSTRAINTS, /* no states were found that meet the constraints */
    FAILURE_MASSLESS     /* the flagged coordinates, which have no mass, do not follow from the others */
} FailureKind;

/* Why the last evaluation or solver step failed; failure_sentence (failure.h) puts it in words. */
typedef struct {
    FailureKind kind;
    double time;                     /* s */
    bool coordinates[N_COORDINATES]; /* of SINGULAR, NOT_FINITE and MASSLESS: those concerned */
    int state;                       /* of OVERFLOW and ACCURACY: the worst state */
    double amount;                   /* of ACCURACY: error in units of the tolerance; of the COUNTs: steps */
    double step;                     /* of OVERFLOW and ACCURACY: length of the trial step, s */
#if N_CONSTRAINTS > 0
    double residuals[N_CONSTRAINTS]; /* of CONSTRAINTS: of the first ones, of MASSLESS: of theirs, ... */
    int count;                       /* ... that many */
#endif
} Failure;

/* The longest step (s) that resolves a vibration (rad/s): an eighth of its period, by which ros2 takes 1 % from it in a
   period and radau5 0.03 %. */
#define RESOLVING_STEP(frequency) (0.25 * 3.141592653589793 / (frequency))

/* What the importer should know about a communication step that was completed. */
typedef enum {
    NOTICE_NONE = 0,
    NOTICE_STIFF = 1,  /* the steps of an explicit method are bounded by its stability */
    NOTICE_UNEQUAL = 2, /* the steps of a variational method are not of the same length any more */
    NOTICE_UNRESOLVED = 4, /* steps do not resolve an undamped vibration: implicit methods damp it, fixed steps miss it */
    NOTICE_MOTION = 8, /* of a motion input only the position moves */
    NOTICE_RANGE = 16  /* a coordinate left its range */
} NoticeKind;

typedef struct {
    NoticeKind kind;
    double time; /* s */
    double step; /* length of the solver step, s */
    int index;   /* of the motion, or in BOUNDED */
} Notice;

typedef struct {
    State state;
    Cache cache;
    Scratch scratch;
    Failure failure;
    Notice notice; /* of the last communication step */

    fmi2Type type;
    fmi2CallbackFunctions callbacks;
    bool logging_requested;             /* loggingOn of fmi2Instantiate */
    unsigned categories;                /* bit i: Category i is logged */
    Call call;                          /* the fmi2 function being executed, for messages */
    bool noted_calls[N_CALLS];          /* tolerated calls are noted once */
    bool noted_kinds[N_VARIABLE_KINDS]; /* so are tolerated settings of variables, ... */
    bool noted_singularity;             /* ... and that the run comes to a singular mass matrix */
    char name[];                        /* instanceName, a copy */
} Instance;

/* Brings an instance to the state "instantiated" with all start values; both fmi2Instantiate and fmi2Reset do this. */
void instance_start(Instance *instance);

/* Writes a double of the State (time, a state, an input, a parameter; SI) and marks what depended on it as outdated.
   The same bits once more change nothing, so that a solver may go on with its stored derivative. */
void instance_assign(Instance *instance, double *slot, double value);

/* Marks all values outside the State as outdated, or those that depend on time, states or inputs. */
void instance_forget_cache(Instance *instance);
void instance_forget_motion(Instance *instance);

/* The derivatives by time, of this order, of the inputs of a State. */
static inline double *input_derivatives(State *state, int order) {
    return state->inputs + order * N_INPUTS;
}

/* The name of the variable of this kind and index, "?" if it has none. */
const char *variable_name(VariableKind kind, int index);

/* The name of the entry with this index, 0 to 2n - 1, of [q, qd]. */
const char *state_name(int index);

/* The start of every fmi2 function: the instance if the call is legal now, else NULL after the error was reported. */
Instance *instance_enter(fmi2Component component, Call call);

/* The same for functions that look at the present point or change it: it is brought up to date. */
Instance *instance_enter_present(fmi2Component component, Call call);

#endif
