/* What changes with time: the State, which the importer may save, restore and serialise.

   In all headers n = N_COORDINATES, m = N_CONSTRAINTS, h = N_HOLONOMIC. Unless it is said otherwise states are [q, qd]
   and behind them the further states z, [N_STATES], derivatives their rates, inputs [N_INPUTS], unknowns qdd[n] with
   the multipliers[m] behind them. Everything is in SI units, times and lengths of steps in s. Matrices are
   row-major. */
#ifndef STATE_H
#define STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "constraint_records.h"
#include "event_sizes.h"
#include "mechanism.h"
#include "observer_memory.h"
#include "sizes.h"
#include "solver_memory.h"

#define N_UNKNOWNS (N_COORDINATES + N_CONSTRAINTS)             /* accelerations and multipliers */
#define N_RESIDUALS (N_UNKNOWNS + N_CONSTRAINTS + N_HOLONOMIC) /* and the constraints' velocities and positions */

enum { HERMITE_TERMS = 3, DENSE_TERMS = HERMITE_TERMS + DENSE_ROWS };
enum { FIRST_MOTION = N_INPUTS - 3 * N_MOTIONS };   /* among the inputs */
enum { MAX_OUTPUT_ORDER = 2 };                      /* the highest time derivatives given */

/* The last solver step, if it went beyond the end of the communication step, see dense_output.h. */
typedef struct {
    double start, end;           /* s */
    double rate;                 /* 1/s: 1 / (end - start) */
    double states[N_STATES];     /* at its start */
    double end_states[N_STATES]; /* at its end */
    double terms[DENSE_TERMS][N_STATES];
} Dense;

/* How far the instance has come. */
typedef enum {
    PHASE_SETTING_UP,    /* start values are given, and nothing follows from them yet */
    PHASE_SOLVING_START, /* start values are given, and constraints determine the others */
    PHASE_RUNNING
} Phase;

/* How a contact, a stop or a dry friction holds; the values of the FMU's enumeration. No friction is ever open. Where
   the slip velocity is one number, forward is where it is positive. */
typedef enum {
    MODE_OPEN = 1,
    MODE_STICKS,
    MODE_SLIDES, /* in space, or closed without friction */
    MODE_SLIDES_FORWARD,
    MODE_SLIDES_BACKWARD
} ElementMode;

/* Impacts that accumulate: after the last one that is followed the contact rises to the top of its rebound, and from
   there on it is closed for as long as the others would last. */
typedef enum { CASCADE_NONE, CASCADE_RISES, CASCADE_RESTS } Cascade;

/* Members are double and int64_t only and there are no pointers: the layout is the same in 32 and 64 bits, without
   padding, and a plain copy is a complete copy. */
typedef struct {
    int64_t phase;     /* Phase */
    double time;       /* s; where the instance integrates, also the last successful time */
    double start_time; /* s; of the experiment */
    double stop_time;  /* s; valid if stop_time_defined */
    int64_t stop_time_defined;
    double tolerance;  /* relative; that of the importer, 0 if it gave none */
    int64_t settled;   /* the states meet the constraints at the start, and what has no mass follows from the present
                          states proper */

    double massless[2][SIZE_MASSLESS]; /* positions and velocities of what has no mass at the last completed step */
    int64_t displaced;                 /* inputs or parameters were changed in the present event */
    int64_t rows_known;                /* the independent rows were found */
    IndependentRows rows;              /* found at the start */
    int64_t usual_known;               /* usual[] holds accelerations, see Policy.remember */
    double usual_time;                 /* s; of the last completed step */
    double usual[1 + MAX_OUTPUT_ORDER][N_COORDINATES]; /* accelerations at that time and their time derivatives */

    double states[N_STATES]; /* [q, qd, z] */
    double inputs[(2 + MAX_INPUT_ORDER) * N_INPUTS]; /* with their derivatives by time, of order 1, 2, 3 at the present
                                                        time, and zeros behind them */
    int64_t input_derivatives_set; /* derivatives were set for the next communication step; if not, they are still those
                                      of the end of the last one */
    double parameters[SIZE_PARAMETERS];
    double settings[N_SETTINGS]; /* by Setting */

    int64_t modes[SIZE_ELEMENTS];       /* ElementMode of contacts and stops, then of dry frictions */
    int64_t impacts[SIZE_UNILATERALS];  /* of each contact so far */
    double impulses[SIZE_UNILATERALS];  /* of their last impacts, normal; N s, or N m s where the gap is an angle */
    int64_t cascading[SIZE_UNILATERALS]; /* Cascade */
    double top_time[SIZE_UNILATERALS];  /* s; of the last rebound of a cascade */
    double rest_time[SIZE_UNILATERALS]; /* s; of its end */
    double slip_decelerations[SIZE_UNILATERALS]; /* m/s^2: of contacts in space that slide, by their friction alone, at
                                                    most, when they began to */
    double slip_ends[SIZE_UNILATERALS]; /* m/s or rad/s: speeds at which modes of slips in space end; 0: at none */
    int64_t modes_settled;              /* the modes belong to the present point: nothing was assigned since */
    int64_t event_pending;              /* the solver has come to an event and has not passed it yet */
    int64_t event_held;                 /* the communication step ended at an event, before it was passed */
    int64_t due[SIZE_EVENTS];           /* the event functions that came down there */
    int64_t jams;                       /* there a force without bound or modes that go round: an impact stops a slip */
    double event_rests[SIZE_EVENTS];    /* how far each of them was from 0 at its last event, by rounding */
    double pending_rests[SIZE_EVENTS];  /* those from the pending event on, if it is passed */
    double contact_sizes[SIZE_EVENTS];  /* typical sizes of the event functions of contacts in their present modes */
    double event_time;                  /* s; of the last event */
    double step_ends[2];                /* s; with an importer's solver: of the last completed step, and before it of
                                           the one before or the last event */
    double event_gap;                   /* s; the time that is expected between events, see event_steps.c */
    int64_t events_there;               /* the number of events at that time */

    double next_step;             /* s; proposal for the next solver step, 0 before the first one */
    double previous_log_error;    /* ln of the error of the last full step in tolerances, for the PI controller */
    int64_t steps;                /* solver steps accepted so far */
    int64_t stiff_steps;          /* steps in the present series that are as long as stability allows */
    int64_t easy_steps;           /* shorter steps in the present series */
    double equal_step;            /* s; of a variational method: the length of all steps so far, 0 before the first */
    int64_t noticed;              /* NoticeKinds that were given, as bits: each is given once */
    int64_t left_range[SIZE_BOUNDED]; /* notice was given that this coordinate left its range */
    double positions[SIZE_MOTIONS]; /* of motions at the end of the last communication step */
    int64_t lone_moves;           /* communication steps in which only the position of a motion was moved */
    int64_t first_stage_valid;    /* first_stage belongs to the present time, states, inputs and parameters; if the
                                     solver is ahead, to the end of the step in dense */
    int64_t ahead;                /* the solver goes on from the end of the step in dense */
    int64_t undisturbed;          /* nothing was changed since the end of the last communication step */
    double grid_start, grid_end;  /* s; the last communication step that was divided into equal steps */
    double interrupted;           /* s; what was left of a communication step that ended early, when the solver began to
                                     step; 0 if none ended early */
    double first_stage[N_STATES]; /* dx/dt */
    SolverMemory solver;
    Dense dense;
    ObserverMemory observer;
} State;

/* The derivatives by time, of this order, of the inputs of a State. */
static inline double *input_derivatives(State *state, int order) {
    return state->inputs + order * N_INPUTS;
}

/* Are all numbers in range that index or count? A checksum keeps damage out, but not who can compute it. */
bool state_in_range(const State *state);

#endif
