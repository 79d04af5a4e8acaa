/* Runs of a mechanism for studies: sweeps, calibration, derivatives through time. A program loads the library and calls
   these functions from one thread for each study; nothing of FMI is in between. */
#ifndef STUDY_H
#define STUDY_H

#include "instance.h"

#if defined(_WIN32)
#define STUDY_EXPORT __declspec(dllexport)
#else
#define STUDY_EXPORT __attribute__((visibility("default")))
#endif

/* What a run is asked for. Variables are given by value references. The inputs follow their signals, linear between the
   knots, or held from knot to knot; before the first and after the last knot they keep their values. */
typedef struct {
    double start;           /* s */
    double tolerance;       /* relative */
    int n_times;
    const double *times;    /* s, ascending, none before the start; the last one is the stop time */
    int n_inputs;
    const int *inputs;
    int n_knots;
    const double *knots;    /* s, ascending */
    const double *signals;  /* (n_knots, n_inputs) */
    int hold;
    int n_outputs;
    const int *outputs;
    double *values;         /* (n_times, n_outputs), the result */
    double *slopes;         /* (n_times, n_outputs, directions), the derivatives; not used without directions */
} Request;

/* The part that every study has: it comes first in its memory. */
typedef struct {
    Instance instance;
    char message[SENTENCE_SIZE]; /* why the last run ended early */
} Study;

/* A study with start values, for derivatives along `directions` directions; NULL without memory. */
STUDY_EXPORT void *study_new(int directions);
STUDY_EXPORT void study_free(void *study);

/* Start values again, and no directions. */
STUDY_EXPORT void study_reset(void *study);

/* Sets start values, parameters, inputs and settings of the solver before a run (SI). */
STUDY_EXPORT void study_set(void *study, int count, const int references[], const double values[]);

/* Runs once after study_reset; returns how many of the times were reached. */
STUDY_EXPORT int study_run(void *study, const Request *request);

STUDY_EXPORT const char *study_message(const void *study);

/* What both kinds of studies share. */

void study_begin(Study *study);

/* Solves the start, before modes are settled, and after that the modes. */
bool study_solve_start(Study *study, const Request *request);
bool study_settle(Study *study);

/* Puts the failure of the instance into the message; returns false. */
bool study_explain(Study *study);

/* Sets the inputs at the present time as the signals say. */
void study_drive(Instance *instance, const Request *request);

/* The next knot after the present time, or the end (s) if that is nearer. */
double study_next_knot(const Instance *instance, const Request *request, double end);

/* values[n_outputs] at the present point. */
bool study_read(Instance *instance, const Request *request, double values[]);

#endif
