/* The memory of an observer. The state that it estimates, [N_OBSERVED], has those of the mechanism, and behind them the
   parameters that are estimated. Its error is basis e, where the covariance of e is root root^T.

   The basis is orthonormal and spans the motions that constraints leave free; its last columns are 0 where these are
   fewer than N_OBSERVED, and so are the last rows and columns of the root, which is lower triangular. */
#ifndef OBSERVER_MEMORY_H
#define OBSERVER_MEMORY_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "observed.h"
#include "sizes.h"

enum { OBSERVES = 1 };

/* Where the variables of the observer are among its slots. */
enum {
    SLOT_SAMPLES = 0,                                     /* what is measured, then whether each sample counts */
    SLOT_COUNTS = SLOT_SAMPLES + N_MEASURED,
    SLOT_NOISE = SLOT_COUNTS + N_MEASURED,                /* standard deviations of what is measured */
    SLOT_SAMPLE_TIMES = SLOT_NOISE + N_MEASURED,          /* s; 0: there is a sample at each communication point */
    SLOT_DELAYS = SLOT_SAMPLE_TIMES + N_MEASURED,         /* s; by which samples are late, if any are */
    SLOT_STARTS = SLOT_DELAYS + DELAYED * N_MEASURED,     /* standard deviations of the start */
    SLOT_DENSITIES = SLOT_STARTS + N_OBSERVED,            /* of the noise of the process */
    SLOT_DEVIATIONS = SLOT_DENSITIES + N_DENSITIES,       /* standard deviations of the estimate */
    SLOT_INNOVATIONS = SLOT_DEVIATIONS + N_OBSERVED,      /* of the last samples; 0 where there was none */
    SLOT_INNOVATION_DEVIATIONS = SLOT_INNOVATIONS + N_MEASURED,
    SLOT_SQUARED = SLOT_INNOVATION_DEVIATIONS + N_MEASURED, /* the normalised innovation squared */
    SLOT_DEGREES,                                         /* the number of samples in it */
    N_OBSERVER_SLOTS
};

/* What was known at a time, before its samples. */
typedef struct {
    double time; /* s */
    double estimate[N_OBSERVED];
    double basis[N_OBSERVED][N_OBSERVED];
    double root[N_OBSERVED][N_OBSERVED];
} Belief;

/* What came at a communication point: inputs, as in the State, and samples. */
typedef struct {
    double time; /* s */
    double inputs[(2 + MAX_INPUT_ORDER) * N_INPUTS];
    int64_t inputs_move;
    double samples[N_MEASURED];
    int64_t counts[N_MEASURED]; /* whether a sample counts */
} CommunicationPoint;

enum { N_PAST = DELAYED ? 256 : 2 }; /* communication points that are kept; more than fit in usual delays */

typedef struct {
    double slots[N_OBSERVER_SLOTS];
    double due[N_MEASURED]; /* s; of the next samples */
    double basis[N_OBSERVED][N_OBSERVED];
    double root[N_OBSERVED][N_OBSERVED];
    Belief earlier;         /* before the first sample that may still come */
    int64_t first, points;  /* of the past: the place of the first one, and how many there are */
    CommunicationPoint past[N_PAST];
} ObserverMemory;

enum {
    N_CLOUD = UNSCENTED ? (SIMPLEX ? N_OBSERVED + 1 : 2 * N_OBSERVED) : 1, /* points about an estimate */
    WIDEST = N_MEASURED + N_CLOUD + N_OBSERVED + 2 * N_DENSITIES
};

typedef struct {
    ObserverMemory before; /* when the communication step began */
    double estimate[N_OBSERVED];
    double parameters[SIZE_PARAMETERS]; /* with the estimated ones */
    double values[N_OBSERVED_ROWS];     /* rates, what is measured, residuals; at the last point looked at */
    double entries[SIZE_OBSERVED_ENTRIES];
    double pivots[N_OBSERVED_PIVOTS];
    double slopes[N_OBSERVED_ROWS][N_OBSERVED_COLUMNS]; /* derivatives of the values by state and noise of inputs */
    double rows[SIZE_BOUND * N_OBSERVED], reflectors[SIZE_BOUND * N_OBSERVED]; /* of constraints */
    double along[N_OBSERVED][N_OBSERVED], sum[N_OBSERVED][N_OBSERVED], product[N_OBSERVED][N_OBSERVED];
    double middle[N_OBSERVED][N_OBSERVED], inlet[N_OBSERVED][SIZE_DENSITIES]; /* in the middle of a step */
    double noise[N_OBSERVED][N_OBSERVED];    /* a root of the covariance that the process adds */
    double cloud[N_CLOUD][N_OBSERVED];
    double reaches[N_OBSERVED][N_CLOUD];     /* of its points along directions, in standard deviations */
    int reached;                             /* the number of directions along which reaches are known */
    double seen[N_CLOUD][N_MEASURED];
    double rest[N_MEASURED * (N_MEASURED + N_CLOUD)]; /* of what is measured; noise, and what errors do not explain */
    double whole[(N_MEASURED + N_OBSERVED) * WIDEST];
} ObserverScratch;

static inline void observer_memory_start(ObserverMemory *memory) {
    memcpy(memory->slots, START_OBSERVER, sizeof memory->slots);
}

static inline bool observer_memory_in_range(const ObserverMemory *memory) {
    return memory->first >= 0 && memory->first < N_PAST && memory->points >= 0 && memory->points <= N_PAST;
}

#endif
