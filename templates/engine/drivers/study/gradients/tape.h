/* The derivatives of one number by everything that a run depends on: the discrete adjoint of the solver's own steps.

   A run is recorded on a tape. Its entries are the beginnings of stretches of smooth inputs, steps, events, and samples
   at the ends of stretches. A number whose derivatives by the samples are known, the weights, is followed backwards:
   with lambda its derivatives by the states,

       lambda- = (dx+/dx-)^T lambda+,   gradient += (dx+/dp)^T lambda+,

   for each entry, the last one first. x+(x-, p) is what the entry has computed: the result is that of directions
   (directions.h) up to rounding. Steps keep their states as checkpoints; their stages are computed again. At events
   and at the start the Jacobian itself is kept: it comes from directions along all that varies (jumps.c).

   Griewank, Walther, Evaluating Derivatives, SIAM 2008, chapters 3 (reverse sweeps) and 12 (checkpoints). */
#ifndef TAPE_H
#define TAPE_H

#include "directions.h"
#include "reverse_memory.h"

typedef enum { ENTRY_STRETCH, ENTRY_STEP, ENTRY_EVENT, ENTRY_SAMPLES } EntryKind;

typedef struct {
    EntryKind kind;
    double time;    /* s; of its beginning */
    Step step;
    int first, end; /* the samples in it */
    size_t base;    /* the last kept motion up to here */
    size_t place;   /* its checkpoint, or of an event its Jacobian */
} Entry;

/* States that an entry begins and ends with, and the slope at its beginning. */
typedef struct {
    double states[N_STATES];
    double slope[N_STATES];
    double unprojected[N_STATES]; /* as the step ended, before it was projected */
    double end_states[N_STATES];
    StepRecord record;
} Checkpoint;

/* What holds from the beginning of a stretch, from an event, or from the turn of a slip on: inputs, modes, switches. */
typedef struct {
    State state;
    bool inputs_move;
    double step_start; /* s */
} Kept;

/* An array that grows. */
typedef struct {
    void *data;
    size_t count, room, size; /* entries, and bytes of one */
} List;

typedef struct {
    Variations *variations;
    const Request *request;
    int varied;      /* the directions that are asked for; behind them there is room for those of what jumps */
    bool no_memory;
    size_t most;     /* entries of a run; 0: any number */
    List entries, checkpoints, kept, jacobians;
    Seed *seeds;     /* of the directions asked for, at the start */
    double *starts;  /* (varied, N_JUMPING): how the start answers to them */
    /* the reverse sweep */
    const double *weights; /* (n_times, n_outputs) */
    size_t base;           /* the kept motion in the instance */
    Seed total;            /* the derivatives by states, inputs and parameters; the states are lambda */
    double *gradient;      /* (varied), the part that events give */
    ReverseMemory method;
} Tape;

/* The entry i of a list. */
static inline void *list_at(const List *list, size_t i) {
    return (char *)list->data + i * list->size;
}

/* A new last entry, without contents; NULL without memory, which the tape notes. */
void *tape_add(Tape *tape, List *list);

/* What the steps of the method need, before the first one. */
void tape_begin_method(Tape *tape);

static inline void tape_add_weighted(double sum[], double factor, const double term[]) {
    for (int i = 0; i < N_STATES; i++) {
        sum[i] += factor * term[i];
    }
}

/* Adds to found[N_STATES] the derivatives by the states of the slope at a time (s) and point, weighed; inputs and
   parameters get theirs in the total. The slope is known. rubbing[n] are weights of what contacts_rub gives there, NULL
   for none. */
bool tape_slope_back(Tape *tape, double time, const double point[], const double slope[], const double weights[],
                     const double rubbing[], double found[]);

/* One step backwards: total.states are the derivatives by the states behind it, and then by those before it. */
bool tape_step_back(Tape *tape, const Entry *entry, const Checkpoint *checkpoint);

/* Adds the derivatives of a sample, by its weights, at a time (s) and states that may be beside the constraints, to the
   total; those by the states to states[N_STATES]. */
bool tape_sample_back(Tape *tape, int sample, double time, const double point[], double states[]);

/* states[N_STATES] are derivatives by what a projection at a time (s) gives, and then by what it takes; derivatives by
   inputs and parameters are added to the total. */
bool tape_project_back(Tape *tape, double time, const double from[], const double to[], double states[]);

#endif
