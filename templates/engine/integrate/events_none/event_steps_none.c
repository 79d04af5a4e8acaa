/* A mechanism whose equations of motion are smooth throughout. */
#include "event_steps.h"

bool events_begin(Instance *instance) {
    (void)instance;
    return true;
}

bool events_end_step(Instance *instance, Step *step) {
    (void)instance;
    (void)step;
    return true;
}

bool events_at_hand(Instance *instance, double span) {
    (void)instance;
    (void)span;
    return false;
}

bool events_pass(Instance *instance) {
    (void)instance;
    return true;
}

int events_latest(const State *state, double since) {
    (void)state;
    (void)since;
    return -1;
}
