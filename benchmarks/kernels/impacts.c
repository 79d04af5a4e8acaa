/* What a run over many impacts costs, and what the same arcs between them cost one by one.

   usage: impacts record TOLERANCE STOP
          impacts run TOLERANCE STOP REPETITIONS
          impacts arcs TOLERANCE STOP REPETITIONS < what record printed
          impacts anew TOLERANCE STOP REPETITIONS < what record printed

   "record" prints each arc of the motion up to STOP (s): the time of its end, and q, qd at its beginning. "run"
   integrates over the events, "arcs" from one recorded beginning to its end after the other, in a mechanism without
   contacts; the solver goes on with the length of step that it has come to. "anew" does the same without that length:
   it is found at the beginning of each arc, as in a run of its own. All print the least CPU time (us) of the
   repetitions, then q, qd at the end. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "component.h"
#include "fmi2Functions.h"
#include "host.h"
#include "integrator.h"

enum { MOST_ARCS = 100000, LENGTH = 2 * N_COORDINATES };

typedef struct {
    double end;
    double states[LENGTH];
} Arc;

static Component *start(double tolerance, double stop) {
    static fmi2CallbackFunctions callbacks;
    Component *unit = fmi2Instantiate("run", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    demand(unit != NULL, "fmi2Instantiate");
    fmi2SetupExperiment(unit, fmi2True, tolerance, 0.0, fmi2True, stop);
    fmi2EnterInitializationMode(unit);
    demand(fmi2ExitInitializationMode(unit) == fmi2OK, "fmi2ExitInitializationMode");
    return unit;
}

static void print(double time, const double states[]) {
    printf("%.17g", time);
    for (int i = 0; i < LENGTH; i++) {
        printf(" %.17g", states[i]);
    }
    printf("\n");
}

static void record(Instance *instance, double stop) {
    State *state = &instance->state;
    double states[LENGTH];
    instance->listener.awaits_events = true;
    while (state->time < stop) {
        const double begin = state->time;
        memcpy(states, state->states, sizeof states);
        demand(integrate(instance, stop), "integrate");
        if (state->time > begin) {
            print(state->time, states);
        }
        demand(state->time >= stop || integrator_settle(instance), "integrator_settle");
    }
}

static long read_arcs(Arc arcs[]) {
    long count = 0;
    while (count < MOST_ARCS && scanf("%lf", &arcs[count].end) == 1) {
        for (int i = 0; i < LENGTH; i++) {
            demand(scanf("%lf", &arcs[count].states[i]) == 1, "reading an arc");
        }
        count++;
    }
    return count;
}

static void take_arcs(Instance *instance, const Arc arcs[], long count, int anew) {
    State *state = &instance->state;
    for (long i = 0; i < count; i++) {
        memcpy(state->states, arcs[i].states, sizeof arcs[i].states);
        state->first_stage_valid = state->undisturbed = state->ahead = 0;
        state->next_step = anew ? 0.0 : state->next_step;
        demand(integrate(instance, arcs[i].end), "integrate");
    }
}

int main(int given, char *arguments[]) {
    static Arc arcs[MOST_ARCS];
    demand(given == 4 || given == 5, "usage");
    const double tolerance = atof(arguments[2]), stop = atof(arguments[3]);
    const int anew = strcmp(arguments[1], "anew") == 0;
    const long count = anew || strcmp(arguments[1], "arcs") == 0 ? read_arcs(arcs) : 0;
    double least = 1e300, end[LENGTH] = {0.0};
    for (long repetition = 0; repetition < (given == 5 ? atol(arguments[4]) : 1); repetition++) {
        Component *unit = start(tolerance, stop);
        const double begin = now();
        if (given == 4) {
            record(&unit->instance, stop);
        } else if (count > 0) {
            take_arcs(&unit->instance, arcs, count, anew);
        } else {
            demand(integrate(&unit->instance, stop), "integrate");
        }
        const double cost = now() - begin;
        least = cost < least ? cost : least;
        memcpy(end, unit->instance.state.states, sizeof end);
        fmi2FreeInstance(unit);
    }
    if (given == 5) {
        print(1e6 * least, end);
    }
    return 0;
}
