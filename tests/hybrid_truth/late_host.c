/* A host of model exchange with fixed steps of an explicit Runge-Kutta method. It sees an event after the step in which
   an indicator changes its sign, and passes it there, as many real-time and block simulators do. */
#include <string.h>

#include "fmi2FunctionTypes.h"

/* The functions of the FMU, and the host's memory between steps. */
typedef struct {
    fmi2Component component;
    fmi2SetTimeTYPE *set_time;
    fmi2SetContinuousStatesTYPE *set_states;
    fmi2GetContinuousStatesTYPE *get_states;
    fmi2GetDerivativesTYPE *get_derivatives;
    fmi2GetEventIndicatorsTYPE *get_indicators;
    fmi2CompletedIntegratorStepTYPE *completed_step;
    fmi2EnterEventModeTYPE *enter_event_mode;
    fmi2NewDiscreteStatesTYPE *new_discrete_states;
    fmi2EnterContinuousTimeModeTYPE *enter_continuous_time_mode;
    size_t states, events, stages;
    const double *place, *weight; /* [stages] of the method: each stage begins with the slope of the one before */
    double *x, *start, *slope, *sum; /* [states] */
    double *indicators, *signs;      /* [events] */
    double next_time;                /* of a time event, s */
} LateHost;

int late_begin(LateHost *host);
int late_steps(LateHost *host, double step, size_t first, size_t end);

static void keep_signs(LateHost *host) {
    for (size_t i = 0; i < host->events; i++) {
        host->signs[i] = (double)(host->indicators[i] > 0.0);
    }
}

static int signs_differ(const LateHost *host) {
    int differ = 0;
    for (size_t i = 0; i < host->events; i++) {
        differ = differ || (host->indicators[i] > 0.0) != (host->signs[i] > 0.0);
    }
    return differ;
}

/* Reads states and indicators in continuous-time mode. Returns the worst status. */
int late_begin(LateHost *host) {
    const int states = (int)host->get_states(host->component, host->x, host->states);
    const int indicators = (int)host->get_indicators(host->component, host->indicators, host->events);
    keep_signs(host);
    return states > indicators ? states : indicators;
}

static int pass_event(LateHost *host) {
    fmi2EventInfo info;
    int status = (int)host->enter_event_mode(host->component);
    do {
        memset(&info, 0, sizeof info);
        const int found = (int)host->new_discrete_states(host->component, &info);
        status = found > status ? found : status;
    } while (info.newDiscreteStatesNeeded && status <= (int)fmi2Warning);
    host->next_time = info.nextEventTimeDefined ? info.nextEventTime : 1e300;
    const int entered = (int)host->enter_continuous_time_mode(host->component);
    const int begun = late_begin(host);
    status = entered > status ? entered : status;
    return begun > status ? begun : status;
}

static int move(LateHost *host, double time) {
    const int set = (int)host->set_time(host->component, time);
    const int moved = (int)host->set_states(host->component, host->x, host->states);
    return set > moved ? set : moved;
}

static int take_step(LateHost *host, double time, double length) {
    fmi2Boolean wanted = fmi2False, ends = fmi2False;
    int status = (int)fmi2OK;
    memcpy(host->start, host->x, host->states * sizeof(double));
    memset(host->sum, 0, host->states * sizeof(double));
    for (size_t s = 0; s < host->stages && status <= (int)fmi2Warning; s++) {
        if (host->place[s] > 0.0) {
            for (size_t i = 0; i < host->states; i++) {
                host->x[i] = host->start[i] + host->place[s] * length * host->slope[i];
            }
            status = move(host, time + host->place[s] * length);
        }
        if (status <= (int)fmi2Warning) {
            status = (int)host->get_derivatives(host->component, host->slope, host->states);
        }
        for (size_t i = 0; i < host->states; i++) {
            host->sum[i] += host->weight[s] * host->slope[i];
        }
    }
    for (size_t i = 0; i < host->states; i++) {
        host->x[i] = host->start[i] + length * host->sum[i];
    }
    if (status > (int)fmi2Warning || (status = move(host, time + length)) > (int)fmi2Warning ||
        (status = (int)host->get_indicators(host->component, host->indicators, host->events)) > (int)fmi2Warning ||
        (status = (int)host->completed_step(host->component, fmi2True, &wanted, &ends)) > (int)fmi2Warning) {
        return status;
    }
    return wanted || signs_differ(host) || time + length >= host->next_time ? pass_event(host) : status;
}

/* Steps number first to end - 1 of this length, s. Returns the status of the last one, beyond fmi2Warning if it failed. */
int late_steps(LateHost *host, double step, size_t first, size_t end) {
    int status = (int)fmi2OK;
    for (size_t i = first; i < end && status <= (int)fmi2Warning; i++) {
        status = take_step(host, (double)i * step, step);
    }
    return status;
}
