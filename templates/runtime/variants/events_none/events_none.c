/* A mechanism whose equations of motion are smooth throughout. */
#include "events.h"

#include <math.h>

bool events_evaluate(Instance *instance, double time, const double states[], double values[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)values;
    return true;
}

bool events_settle(Instance *instance, const bool due[], bool *jumped) {
    (void)instance;
    (void)due;
    *jumped = false;
    return true;
}

bool events_refresh(Instance *instance, bool *jumped) {
    (void)instance;
    *jumped = false;
    return true;
}

bool events_go_on(Instance *instance) {
    (void)instance;
    return true;
}

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

bool events_indicate(Instance *instance, double indicators[]) {
    (void)instance;
    (void)indicators;
    return true;
}

double events_next_time(Instance *instance) {
    (void)instance;
    return HUGE_VAL;
}

void events_sentence(const Failure *failure, char text[], size_t size) {
    (void)failure;
    (void)size;
    text[0] = '\0';
}

int events_latest(const State *state, double since) {
    (void)state;
    (void)since;
    return -1;
}

const char *events_name(int k) {
    (void)k;
    return "";
}
