/* Times an FMU's solver against CVODE on the same generated equations: Adams methods with functional iteration, or BDF
   with Newton's method, a dense solver and CVODE's own difference quotients; and, with DOP853 and RADAU5 defined,
   against the codes of Hairer and Wanner that PyDSTool carries, dop853 in C (without constraints only) and radau5 in
   Fortran. Equations with constraints are evaluated by the FMU in model exchange, where they are stabilised; the others
   by a direct call.

   usage: integrators own|read|adams|bdf|dop853|radau5 TOLERANCE STOP STEP ROUNDS. "read" gets all outputs after each
   step. Integrates from 0 to STOP (s) in communication steps of STEP, ROUNDS times; prints the least and the median CPU
   time (ns), the evaluations of one run, the states at the end. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"
#include "mechanism.h"
#ifdef DOP853
#include "dop853.h"
#endif
#ifdef RADAU5
#include "radau5.h"
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

/* dy = dy/dt for the peers; not 0 if there is none. */
static int rates(double t, const double y[], double dy[]) {
#if N_CONSTRAINTS > 0
    fmi2Component c = start(NULL);
    evaluations++;
    fmi2SetTime(c, t);
    fmi2SetContinuousStates(c, y, N_STATES);
    return fmi2GetDerivatives(c, dy, N_STATES) == fmi2OK ? 0 : 1;
#else
    double pivots[N_COORDINATES];
    memcpy(dy, y + N_COORDINATES, N_COORDINATES * sizeof(double));
    mechanism_accelerations(t, y, START_INPUTS, START_PARAMETERS, dy + N_COORDINATES, pivots);
    return 0;
#endif
}

static int derivatives(double t, N_Vector y, N_Vector dy, void *data) {
    (void)data;
    return rates(t, y->content->data, dy->content->data);
}

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

#ifdef DOP853
static void slope(unsigned n, double t, double *y, double *parameters, double *dy) {
    (void)n;
    (void)parameters;
    rates(t, y, dy);
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

#ifdef RADAU5
static void stiff_slope(int *n, double *t, double *y, double *dy, double *reals, int *integers) {
    (void)n;
    (void)reals;
    (void)integers;
    rates(*t, y, dy);
}

static void keep_stiff_step(double *t, double *h) {
    (void)t;
    (void)h;
}

/* One run of radau5 with the same error weights (it takes their root mean square), in one step, with its own difference
   quotients; it is told that the first half of the states are coordinates, the second half their velocities. */
static double run_radau5(const Task *task, double x[]) {
    enum { N = N_STATES, HALF = N_COORDINATES, REALS = 20 + N * (HALF + 3 * N + 12), INTEGERS = 20 + 3 * N };
    static double first[N], reals[REALS];
    static int integers[INTEGERS];
    static int started;
    double t = 0.0, end = task->stop, h = 0.0, relative[N], absolute[N], unused = 0.0;
    int n = N, vectors = 1, no = 0, lower = HALF, upper = 0, lower_mass = 0, upper_mass = 0; /* some are written to */
    int size = REALS, integer_size = INTEGERS, outcome = 0, spare = 0;
    if (!started) {
        start(first);
        started = 1;
    }
    for (int i = 0; i < N; i++) {
        relative[i] = task->tolerance;
        absolute[i] = task->tolerance * NOMINAL_STATES[i];
    }
    memset(reals, 0, sizeof reals);
    memset(integers, 0, sizeof integers);
    integers[1] = 100000000; /* steps at most */
    integers[8] = integers[9] = HALF;
    memcpy(x, first, sizeof first);
    const double begin = now();
    radau5_(&n, stiff_slope, &t, x, &end, &h, relative, absolute, &vectors, NULL, &no, &lower, &upper, NULL, &no,
            &lower_mass, &upper_mass, NULL, &no, reals, &size, integers, &integer_size, &unused, &spare, &outcome,
            keep_stiff_step);
    const double time = now() - begin;
    demand(outcome == 1, "radau5");
    return time;
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
#ifdef DOP853
        } else if (strcmp(arguments[1], "dop853") == 0) {
            times[i] = run_dop853(&task, x);
#endif
#ifdef RADAU5
        } else if (strcmp(arguments[1], "radau5") == 0) {
            times[i] = run_radau5(&task, x);
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
