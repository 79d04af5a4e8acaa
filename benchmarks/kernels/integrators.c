/* Times an FMU's solver against CVODE on the same generated equations: Adams methods with functional iteration, or BDF with
   Newton's method, a dense solver and CVODE's own difference quotients; and, with HAIRER defined, against the code dop853
   of Hairer and Wanner in the C version that PyDSTool carries, without constraints only. Equations with constraints are evaluated by the
   FMU in model exchange, where they are stabilised; the others by a direct call.

   usage: integrators own|read|adams|bdf|dop853 TOLERANCE STOP STEP ROUNDS. "read" gets all outputs after each step. Integrates from 0 to STOP (s) in communication steps of STEP,
   ROUNDS times; prints the least and the median CPU time (ns), the evaluations of one run, the states at the end. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"
#include "mechanism.h"
#ifdef HAIRER
#include "dop853.h"
#endif

/* What is used of SUNDIALS 7; fmpy carries its libraries, but not its headers. */
typedef void *SUNContext, *SUNNonlinearSolver, *SUNLinearSolver, *SUNMatrix;
typedef struct {
    struct {
        int64_t length;
        int own_data;
        double *data;
    } *content;
    void *ops;
    SUNContext context;
} *N_Vector;
enum { CV_ADAMS = 1, CV_BDF = 2, CV_NORMAL = 1 };
int SUNContext_Create(int communicator, SUNContext *context);
N_Vector N_VNew_Serial(int64_t length, SUNContext context);
SUNNonlinearSolver SUNNonlinSol_FixedPoint(N_Vector y, int m, SUNContext context);
void *CVodeCreate(int method, SUNContext context);
int CVodeInit(void *memory, int (*f)(double, N_Vector, N_Vector, void *), double t, N_Vector y);
int CVodeReInit(void *memory, double t, N_Vector y);
int CVodeSVtolerances(void *memory, double relative, N_Vector absolute);
int CVodeSetNonlinearSolver(void *memory, SUNNonlinearSolver solver);
SUNMatrix SUNDenseMatrix(int64_t rows, int64_t columns, SUNContext context);
SUNLinearSolver SUNLinSol_Dense(N_Vector y, SUNMatrix a, SUNContext context);
int CVodeSetLinearSolver(void *memory, SUNLinearSolver solver, SUNMatrix a);
int CVodeSetMaxNumSteps(void *memory, long steps);
int CVodeSetStopTime(void *memory, double t);
int CVode(void *memory, double t, N_Vector y, double *reached, int task);

static long evaluations;

#if N_CONSTRAINTS == 0
/* The linker leads all calls of mechanism_accelerations here (--wrap). */
void __real_mechanism_accelerations(double t, const double x[], const double u[], const double p[], double qdd[],
                                    double pivots[]);
void __wrap_mechanism_accelerations(double t, const double x[], const double u[], const double p[], double qdd[],
                                    double pivots[]);
void __wrap_mechanism_accelerations(double t, const double x[], const double u[], const double p[], double qdd[],
                                    double pivots[]) {
    evaluations++;
    __real_mechanism_accelerations(t, x, u, p, qdd, pivots);
}
#endif

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void demand(int holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "%s failed\n", what);
        exit(2);
    }
}

typedef struct {
    double tolerance, stop, step;
} Task;

/* The value references of the outputs; returns how many there are. */
static size_t outputs_of(fmi2ValueReference references[]) {
    size_t count = 0;
    for (fmi2ValueReference i = 0; i < N_VARIABLES; i++) {
        if (VARIABLES[i].output) {
            references[count++] = i;
        }
    }
    return count;
}

/* One run of the FMU; returns its CPU time, ns. */
static double run_own(const Task *task, int reads, double x[]) {
    fmi2ValueReference outputs[N_VARIABLES];
    double values[N_VARIABLES];
    const size_t n_outputs = outputs_of(outputs);
    static fmi2Component c;
    static fmi2CallbackFunctions callbacks;
    if (c == NULL) {
        c = fmi2Instantiate("timed", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    }
    demand(c != NULL && fmi2Reset(c) == fmi2OK, "fmi2Reset");
    const double begin = now();
    fmi2SetupExperiment(c, fmi2True, task->tolerance, 0.0, fmi2True, task->stop);
    fmi2EnterInitializationMode(c);
    fmi2ExitInitializationMode(c);
    fmi2Status status = fmi2OK;
    const long count = (long)(task->stop / task->step + 0.5);
    const double step = task->stop / (double)count;
    for (long i = 0; i < count && status == fmi2OK; i++) {
        status = fmi2DoStep(c, step * (double)i, step, fmi2True);
        if (reads) {
            fmi2GetReal(c, outputs, n_outputs, values);
        }
    }
    const double time = now() - begin;
    demand(status == fmi2OK, "fmi2DoStep");
    for (fmi2ValueReference i = 0; i < N_VARIABLES; i++) {
        if (VARIABLES[i].kind == VARIABLE_STATE) {
            fmi2GetReal(c, &i, 1, &x[VARIABLES[i].index]);
        }
    }
    return time;
}

/* The states of the start, which meet the constraints, and an instance for model exchange there. */
static fmi2Component start(double x[]) {
    static fmi2Component c;
    static fmi2CallbackFunctions callbacks;
    if (c == NULL) {
        fmi2EventInfo info;
        c = fmi2Instantiate("derivatives", fmi2ModelExchange, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
        demand(c != NULL, "fmi2Instantiate");
        fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
        fmi2EnterInitializationMode(c);
        fmi2ExitInitializationMode(c);
        fmi2NewDiscreteStates(c, &info);
        fmi2EnterContinuousTimeMode(c);
        demand(fmi2GetContinuousStates(c, x, N_STATES) == fmi2OK, "fmi2GetContinuousStates");
    }
    return c;
}

#if N_CONSTRAINTS > 0
static int derivatives(double t, N_Vector y, N_Vector dy, void *data) {
    fmi2Component c = start(NULL);
    (void)data;
    evaluations++;
    fmi2SetTime(c, t);
    fmi2SetContinuousStates(c, y->content->data, N_STATES);
    return fmi2GetDerivatives(c, dy->content->data, N_STATES) == fmi2OK ? 0 : 1;
}
#else
static int derivatives(double t, N_Vector y, N_Vector dy, void *data) {
    double pivots[N_COORDINATES];
    (void)data;
    memcpy(dy->content->data, y->content->data + N_COORDINATES, N_COORDINATES * sizeof(double));
    mechanism_accelerations(t, y->content->data, START_INPUTS, START_PARAMETERS, dy->content->data + N_COORDINATES,
                            pivots);
    return 0;
}
#endif

/* One run of CVODE with the same error weights. */
static double run_cvode(const Task *task, int method, double x[]) {
    static double first[N_STATES];
    static SUNContext context;
    static N_Vector y, absolute;
    static void *memory;
    double reached = 0.0;
    if (memory == NULL) {
        demand(SUNContext_Create(0, &context) == 0, "SUNContext_Create");
        y = N_VNew_Serial(N_STATES, context);
        absolute = N_VNew_Serial(N_STATES, context);
        start(first);
        memory = CVodeCreate(method, context);
        demand(CVodeInit(memory, derivatives, 0.0, y) == 0, "CVodeInit");
        if (method == CV_ADAMS) {
            CVodeSetNonlinearSolver(memory, SUNNonlinSol_FixedPoint(y, 0, context));
        } else {
            SUNMatrix matrix = SUNDenseMatrix(N_STATES, N_STATES, context);
            CVodeSetLinearSolver(memory, SUNLinSol_Dense(y, matrix, context), matrix);
        }
        CVodeSetMaxNumSteps(memory, 100000000);
        for (int i = 0; i < N_STATES; i++) {
            absolute->content->data[i] = task->tolerance * NOMINAL_STATES[i];
        }
        demand(CVodeSVtolerances(memory, task->tolerance, absolute) == 0, "CVodeSVtolerances");
    }
    memcpy(y->content->data, first, N_STATES * sizeof(double));
    const double begin = now();
    demand(CVodeReInit(memory, 0.0, y) == 0, "CVodeReInit");
    CVodeSetStopTime(memory, task->stop * (1.0 + 1e-12));
    const long count = (long)(task->stop / task->step + 0.5);
    const double step = task->stop / (double)count;
    for (long i = 1; i <= count; i++) {
        demand(CVode(memory, step * (double)i, y, &reached, CV_NORMAL) >= 0, "CVode");
    }
    const double time = now() - begin;
    memcpy(x, y->content->data, N_STATES * sizeof(double));
    return time;
}

#ifdef HAIRER
static void slope(unsigned n, double t, double *y, double *parameters, double *dy) {
    double pivots[N_COORDINATES];
    (void)n;
    (void)parameters;
    memcpy(dy, y + N_COORDINATES, N_COORDINATES * sizeof(double));
    mechanism_accelerations(t, y, START_INPUTS, START_PARAMETERS, dy + N_COORDINATES, pivots);
}

static void keep_step(double t, double *h) {
    (void)t;
    (void)h;
}

/* One run of dop853 with the same error weights (it takes their root mean square), in one step. */
static double run_dop853(const Task *task, double x[]) {
    double relative[N_STATES], absolute[N_STATES], unused[N_STATES];
    start(x);
    for (int i = 0; i < N_STATES; i++) {
        relative[i] = task->tolerance;
        absolute[i] = task->tolerance * NOMINAL_STATES[i];
    }
    memcpy(x, START_STATES, sizeof START_STATES);
    const double begin = now();
    demand(dop853(N_STATES, slope, 0.0, x, NULL, task->stop, relative, absolute, 1, NULL, 0, NULL, 0.0, 0.0, 0.0, 0.0,
                  0.0, 0.0, 0.0, 100000000, 0, 0, 0, NULL, 0, 0, 0, unused, keep_step) == 1, "dop853");
    return now() - begin;
}
#endif

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int count, char *arguments[]) {
    demand(count == 6, "usage");
    const Task task = {atof(arguments[2]), atof(arguments[3]), atof(arguments[4])};
    const int rounds = atoi(arguments[5]);
    double x[N_STATES];
    double *times = malloc((size_t)rounds * sizeof(double));
    for (int i = 0; i < rounds; i++) {
        evaluations = 0;
        if (strcmp(arguments[1], "own") == 0 || strcmp(arguments[1], "read") == 0) {
            times[i] = run_own(&task, arguments[1][0] == 'r', x);
#ifdef HAIRER
        } else if (strcmp(arguments[1], "dop853") == 0) {
            times[i] = run_dop853(&task, x);
#endif
        } else {
            times[i] = run_cvode(&task, strcmp(arguments[1], "adams") == 0 ? CV_ADAMS : CV_BDF, x);
        }
    }
    qsort(times, (size_t)rounds, sizeof(double), ascending);
    printf("%.0f %.0f %ld", times[0], times[rounds / 2], evaluations);
    for (int i = 0; i < N_STATES; i++) {
        printf(" %.17g", x[i]);
    }
    printf("\n");
    free(times);
    return 0;
}
